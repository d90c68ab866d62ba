#include "vcharge_camera_driver/driver_options.h"

#include <stdexcept>

namespace vcharge {

void DriverOptions::checkFields() const {
  const auto require = [](bool condition, const char* text) {
    if (!condition) {
      throw std::invalid_argument(text);
    }
  };
  require(source != FrameSourceKind::kV4l2 || !devices.empty(),
          "devices: must name a device node per camera");
  require(source != FrameSourceKind::kV4l2 || cameras.empty() || cameras.size() == devices.size(),
          "devices: must be as many as cameras");
  require(source != FrameSourceKind::kFolder || !folder.empty(),
          "folder: must name the folder of the images");
  require(source != FrameSourceKind::kBag || !bag.empty(), "bag: must name the bag");
  require(source != FrameSourceKind::kBag || odometry_source != OdometrySourceKind::kCan,
          "odometry_source: must be wheel_ticks (those of the bag) or none with source bag");
  require(odometry_source != OdometrySourceKind::kCan || can.isUsed(),
          "can.left_ticks: must describe the wheels' messages with odometry_source can");
  require(odometry_source != OdometrySourceKind::kCan || !odometry.use_steering ||
              can.steering_angle_rad.isUsed(),
          "odometry.use_steering: must be false where can.steering_angle_rad is not described");
}

}  // namespace vcharge
