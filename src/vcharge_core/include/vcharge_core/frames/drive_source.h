#pragma once

#include <cstddef>
#include <functional>
#include <string>

#include "vcharge_core/frames/image.h"
#include "vcharge_core/motion/vehicle_odometry.h"

namespace vcharge {

/// Receives the messages of a drive, in order of stamps from a bag, in order of arrival from live topics.
/// Calls are never concurrent. Both the nodelet and the offline tool of a stage feed it.
class DriveConsumer {
 public:
  virtual ~DriveConsumer() = default;
  /// `camera_index` is the index in the rig; the image has the rig's size.
  virtual void addImage(size_t camera_index, Timestamp stamp, const Image& image) = 0;
  virtual void addOdometry(const VehicleOdometry& odometry) = 0;
  virtual void addWheelTicks(const WheelTicks& /*ticks*/) {}
};

/// Source of a drive: a bag (run() returns at its end) or live topics (run() returns at once and the consumer
/// is called until the source is destroyed).
class DriveSource {
 public:
  /// Receives the fraction of the drive that was delivered, 0 to 1.
  using ProgressCallback = std::function<void(double)>;

  virtual ~DriveSource() = default;
  /// Throws InputError for a drive that cannot be read.
  virtual void run(DriveConsumer* consumer, const ProgressCallback& progress) = 0;
};

}  // namespace vcharge
