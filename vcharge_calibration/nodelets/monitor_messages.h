#pragma once

#include <vcharge_msgs/RigHealth.h>

#include "vcharge_calibration/monitor/rig_monitor.h"
#include "vcharge_ros/drive_monitor.h"

namespace vcharge {

/// What the last part of a monitored drive shows; the monitor must have one.
vcharge_msgs::RigHealth toMessage(const RigMonitor& monitor);

/// The same for /diagnostics: a warning where something changed, or a camera sees little.
DriveMonitor::Report toReport(const vcharge_msgs::RigHealth& health);

}  // namespace vcharge
