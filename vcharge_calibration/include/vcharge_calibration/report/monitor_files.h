#pragma once

#include <map>
#include <string>

#include "vcharge_calibration/monitor/monitor_text.h"
#include "vcharge_calibration/monitor/rig_monitor.h"
#include "vcharge_calibration/monitor/rig_repair.h"

namespace vcharge {

/// Writes deviation.csv (of each part: driven distance, stamp, deviations, their standard deviations, sight
/// of the cameras) and monitor_report.html (makeMonitorReport()) into a folder, which is created. InputError
/// names a file that cannot be written.
void writeMonitorFiles(const std::string& folder, const std::string& title, const RigMonitor& monitor,
                       const MonitorVerdict& verdict);

/// Writes a repaired rig, with its masks, the evidence and the date in its provenance.
void writeRepairedRig(const RigMonitor& monitor, const RigRepair& repair,
                      std::map<std::string, std::string> provenance, const std::string& path);

}  // namespace vcharge
