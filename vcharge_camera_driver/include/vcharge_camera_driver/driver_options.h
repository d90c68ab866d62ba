#pragma once

#include <string>
#include <vector>

#include "vcharge_camera_driver/can_wheel_decoder.h"
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

/// All that the driver needs to know beside the rig.
struct DriverOptions {
  std::vector<std::string> cameras;  ///< of the rig, by name; empty: all
  FrameSourceKind source = FrameSourceKind::kV4l2;
  std::vector<std::string> devices;  ///< v4l2: one device node per camera
  std::string folder;                ///< folder: images NAME/STAMP_NS.png of a drive, shown in real time
  std::string bag;                   ///< bag: a drive, shown in real time
  bool loop = false;                 ///< folder: from the start again at the end
  V4l2FrameSourceOptions v4l2;       ///< the size of the images is the rig's
  int realign_frames = 5;            ///< see TriggerGrouperOptions
  double stamp_offset_s = 0.0;       ///< added to the cameras' stamps, e.g. minus half the exposure
  OdometrySourceKind odometry_source = OdometrySourceKind::kWheelTicks;  ///< can: needs `can`
  std::string can_interface = "can0";
  CanWheelOptions can;  ///< the car's messages
  WheelOdometryOptions odometry;

  template <class Visitor>
  void visitFields(Visitor&& visit) {
    visit("cameras", cameras);
    visit("source", source);
    visit("devices", devices);
    visit("folder", folder);
    visit("bag", bag);
    visit("loop", loop);
    visit("v4l2", v4l2);
    visit("realign_frames", realign_frames);
    visit("stamp_offset_s", stamp_offset_s);
    visit("odometry_source", odometry_source);
    visit("can_interface", can_interface);
    visit("can", can);
    visit("odometry", odometry);
  }
  void validate() const;  ///< throws std::invalid_argument naming the field
};

}  // namespace vcharge
