#pragma once

#include <string>
#include <vector>

#include "vcharge_calibration/monitor/monitor_text.h"

namespace vcharge {

/// A drive that was watched, after the ones before.
struct MonitoredDrive {
  std::string name;
  double end_m = 0.0;  ///< driven until its end, over all drives
};

/// A self-contained HTML page: verdict, what happened when (drives, changes, new versions of the rig), and
/// over the driven distance the deviation of each camera and of the odometer with its standard deviation.
std::string makeMonitorReport(const std::vector<MonitoredDrive>& drives, const RigMonitor& monitor,
                              const MonitorVerdict& verdict);

}  // namespace vcharge
