#pragma once

#include <limits>
#include <optional>
#include <string>
#include <variant>
#include <vector>

#include "vcharge_core/camera/camera_rig.h"
#include "vcharge_core/frames/drive_source.h"

namespace vcharge::internal {

struct CameraImage {
  size_t camera_index;
  Image image;
};

/// One item of a drive's data: odometry, wheel ticks or an image.
using DriveItem = std::variant<VehicleOdometry, WheelTicks, CameraImage>;

/// Order of items with one stamp: odometry, wheel ticks, images in the rig's camera order, and odometry that
/// corrects earlier odometry of this stamp, which was received after the images.
class ItemRanks {
 public:
  int rankOf(Timestamp stamp, const DriveItem& item) {
    if (const auto* image = std::get_if<CameraImage>(&item)) {
      return 2 + static_cast<int>(image->camera_index);
    }
    if (std::holds_alternative<VehicleOdometry>(item)) {
      const bool corrects = last_odometry_ == stamp;
      last_odometry_ = stamp;
      return corrects ? std::numeric_limits<int>::max() : 0;
    }
    return 1;
  }

 private:
  std::optional<Timestamp> last_odometry_;
};

inline void deliver(Timestamp stamp, const DriveItem& item, DriveConsumer* consumer) {
  if (const auto* image = std::get_if<CameraImage>(&item)) {
    consumer->addImage(image->camera_index, stamp, image->image);
  } else if (const auto* odometry = std::get_if<VehicleOdometry>(&item)) {
    consumer->addOdometry(*odometry);
  } else {
    consumer->addWheelTicks(std::get<WheelTicks>(item));
  }
}

/// Indices of the named cameras, or of all cameras if `names` is empty. Throws InputError for a name that the
/// rig does not have.
inline std::vector<size_t> selectCameras(const CameraRig& rig, const std::vector<std::string>& names) {
  std::vector<size_t> indices;
  for (const std::string& name : names) {
    indices.push_back(rig.cameraIndex(name));
  }
  if (names.empty()) {
    for (size_t i = 0; i < rig.cameras.size(); ++i) {
      indices.push_back(i);
    }
  }
  return indices;
}

}  // namespace vcharge::internal
