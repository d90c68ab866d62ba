#pragma once

#include <string>
#include <vector>

#include "vcharge_camera_driver/can_wheel_options.h"
#include "vcharge_camera_driver/v4l2_frame_source.h"
#include "vcharge_wheel_odometry/wheel_odometry.h"

namespace vcharge {

enum class FrameSourceKind { kV4l2, kFolder, kBag };
enum class OdometrySourceKind { kNone, kCan, kWheelTicks };

template <>
inline std::vector<std::string> enumNames<FrameSourceKind>() {
  return {"v4l2", "folder", "bag"};
}
template <>
inline std::vector<std::string> enumNames<OdometrySourceKind>() {
  return {"none", "can", "wheel_ticks"};
}

/// Configuration of the driver in addition to the rig.
struct DriverOptions {
  VCHARGE_BEGIN_OPTIONS(DriverOptions);
  VCHARGE_OPTION(std::vector<std::string>, cameras, {}, anyValue(),
                 "Names of cameras of the rig; empty: all.");
  VCHARGE_OPTION(FrameSourceKind, source, FrameSourceKind::kV4l2, anyValue(), "Source of the images.");
  VCHARGE_OPTION(std::vector<std::string>, devices, {}, anyValue(),
                 "Device node of each camera (source v4l2).");
  VCHARGE_OPTION(std::string, folder, "", anyValue(),
                 "Folder of recorded images NAME/STAMP_NS.png, played in real time (source folder).");
  VCHARGE_OPTION(std::string, bag, "", anyValue(), "Recorded drive, played in real time (source bag).");
  VCHARGE_OPTION(bool, loop, false, anyValue(), "Whether the images of a folder repeat.");
  VCHARGE_OPTION_GROUP(V4l2FrameSourceOptions, v4l2, {},
                       "Capture from the cameras; the rig sets the image size.");
  VCHARGE_OPTION(
      double, stamp_offset_s, 0.0, between(-1.0, 1.0),
      "Added to the stamps of the middle of the exposure, for example minus the time of transmission.");
  VCHARGE_OPTION(OdometrySourceKind, odometry_source, OdometrySourceKind::kWheelTicks, anyValue(),
                 "Source of the wheel data.");
  VCHARGE_OPTION(std::string, can_interface, "can0", anyValue(), "Network interface of the CAN bus.");
  VCHARGE_OPTION_GROUP(CanWheelOptions, can, {}, "Messages of the car (odometry source can).");
  VCHARGE_OPTION_GROUP(WheelOdometryOptions, odometry, {}, "Odometry from the wheel data.");
  VCHARGE_END_OPTIONS();
  void checkFields() const;
};

}  // namespace vcharge
