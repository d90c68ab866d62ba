#pragma once

#include <string>

#include "vcharge_calibration/monitor/monitor_text.h"

namespace vcharge {

/// A self-contained HTML page: verdict, changes, and over the driven distance the deviation of each camera
/// and of the odometer with its standard deviation, changes marked.
std::string makeMonitorReport(const std::string& title, const RigMonitor& monitor,
                              const MonitorVerdict& verdict);

}  // namespace vcharge
