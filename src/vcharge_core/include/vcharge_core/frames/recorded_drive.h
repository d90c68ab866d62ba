#pragma once

#include <cstddef>
#include <string>

#include "vcharge_core/frames/image.h"
#include "vcharge_core/motion/vehicle_odometry.h"

namespace vcharge {

/// Takes a recorded drive as it was recorded: nothing is sorted, and nothing refused. For judging recordings;
/// what works on drives takes them from a DriveSource.
class RecordedDriveConsumer {
 public:
  virtual ~RecordedDriveConsumer() = default;
  /// camera_index is that of the rig; the image may have any size. `recorded` is when it was written down.
  virtual void addImage(size_t camera_index, Timestamp stamp, Timestamp recorded, const Image& image) = 0;
  virtual void addOdometry(Timestamp recorded, const VehicleOdometry& odometry) = 0;
  /// A message that cannot be understood, and why.
  virtual void addBroken(const std::string& topic, const std::string& why) = 0;
};

}  // namespace vcharge
