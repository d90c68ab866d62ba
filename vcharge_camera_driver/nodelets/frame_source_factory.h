#pragma once

#include <functional>
#include <memory>
#include <string>

#include "vcharge_camera_driver/driver_options.h"
#include "vcharge_camera_driver/frame_source.h"
#include "vcharge_core/camera/camera_rig.h"
#include "vcharge_core/motion/vehicle_odometry.h"

namespace vcharge {

/// The options with the cameras and the image size filled in from the rig. InputError "parameter <source>:
/// ..." if devices and cameras do not match, or if the cameras' image sizes differ.
DriverOptions completeOptions(const DriverOptions& options, const CameraRig& rig, const std::string& source);

/// The source of images that the options select. `ticks` receives the wheel ticks of a bag.
std::unique_ptr<FrameSource> makeFrameSource(const DriverOptions& options,
                                             const std::shared_ptr<const CameraRig>& rig,
                                             std::function<Timestamp()> now,
                                             std::function<void(const WheelTicks&)> ticks);

}  // namespace vcharge
