#pragma once

#include <map>
#include <string>
#include <vector>

#include "vcharge_calibration/monitor/monitor_text.h"
#include "vcharge_calibration/monitor/rig_monitor.h"
#include "vcharge_calibration/report/monitor_report.h"

namespace vcharge {

/// Writes deviation.csv (of each part: driven distance, stamp, deviations, their standard deviations, sight
/// of the cameras) and monitor_report.html (makeMonitorReport()) into a folder, which is created. InputError
/// names a file that cannot be written.
void writeMonitorFiles(const std::string& folder, const std::vector<MonitoredDrive>& drives,
                       const RigMonitor& monitor, const MonitorVerdict& verdict);

/// Writes the rig of a RigRepair, with its masks, and the date in its provenance. An older file stays beside
/// it as `<name>_until_<date>.yaml`.
void writeRepairedRig(const CameraRig& rig, std::map<std::string, std::string> provenance,
                      const std::string& path);

}  // namespace vcharge
