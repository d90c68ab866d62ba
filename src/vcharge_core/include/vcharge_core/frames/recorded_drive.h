#pragma once

#include <cstddef>
#include <string>

#include "vcharge_core/frames/image.h"
#include "vcharge_core/motion/vehicle_odometry.h"

namespace vcharge {

/// Receives a drive as it was recorded, without sorting or checks. For checking recordings; stages use a
/// DriveSource.
class RecordedDriveConsumer {
 public:
  virtual ~RecordedDriveConsumer() = default;
  /// `camera_index` is the index in the rig; the image may have any size. `recorded`: the time of recording.
  virtual void addImage(size_t camera_index, Timestamp stamp, Timestamp recorded, const Image& image) = 0;
  virtual void addOdometry(Timestamp recorded, const VehicleOdometry& odometry) = 0;
  /// Reports a message that cannot be read, and the reason.
  virtual void addBroken(const std::string& topic, const std::string& why) = 0;
};

}  // namespace vcharge
