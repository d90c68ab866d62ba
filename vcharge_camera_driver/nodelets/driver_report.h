#pragma once

#include "vcharge_camera_driver/can_reader.h"
#include "vcharge_camera_driver/frame_source.h"
#include "vcharge_camera_driver/trigger_grouper.h"
#include "vcharge_ros/drive_monitor.h"

namespace vcharge {

/// State of one camera.
DriveMonitor::Report reportCamera(const std::string& name, const CameraStatus& status,
                                  const TriggerCameraCounts& counts);
/// State of the synchronization; `before` holds the counts at the previous report.
DriveMonitor::Report reportSync(const TriggerGrouperCounts& now, const TriggerGrouperCounts& before);
/// State of the CAN bus.
DriveMonitor::Report reportCan(const CanStatus& status);

}  // namespace vcharge
