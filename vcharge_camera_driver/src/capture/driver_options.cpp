#include "vcharge_camera_driver/driver_options.h"

#include <cmath>

namespace vcharge {

void DriverOptions::validate() const {
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
  validateInner("v4l2", v4l2);
  requireField(realign_frames >= 1, "realign_frames", "must be at least 1", realign_frames);
  requireField(std::abs(stamp_offset_s) <= 1.0, "stamp_offset_s", "must be in [-1, 1]", stamp_offset_s);
  if (odometry_source == OdometrySourceKind::kCan) {
    validateInner("can", can);
  }
  validateInner("odometry", odometry);
}

}  // namespace vcharge
