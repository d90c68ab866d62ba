#pragma once

#include <optional>
#include <string>

#include "vcharge_camera_driver/can_reader.h"
#include "vcharge_camera_driver/frame_source.h"
#include "vcharge_camera_driver/trigger_grouper.h"
#include "vcharge_ros/drive_monitor.h"

namespace vcharge {

/// State of one camera; `counts`: if it has a trigger in common with others.
DriveMonitor::Report reportCamera(const std::string& name, const CameraStatus& status,
                                  const std::optional<TriggerCameraCounts>& counts);
/// State of the synchronization; `before` holds the counts of the previous report, and then those of this
/// one.
DriveMonitor::Report reportSync(const TriggerGrouperCounts& now, TriggerGrouperCounts* before);
/// State of the CAN bus.
DriveMonitor::Report reportCan(const CanStatus& status);

}  // namespace vcharge
