#pragma once

#include <cstddef>
#include <optional>
#include <utility>
#include <vector>

#include "vcharge_core/frames/frame_assembler.h"

namespace vcharge {

/// What is done to a recorded drive to see how localization takes it. Times are seconds since its first
/// frame.
struct DriveExperimentOptions {
  std::vector<size_t> cameras;                       ///< that are used; empty: all
  std::optional<std::pair<double, double>> cover_s;  ///< all cameras are covered from, to
  /// From, to: the vehicle is carried away, unseen by its cameras and its odometer.
  std::optional<std::pair<double, double>> carry_s;
};

/// Changes a drive's frames one by one, in order.
class DriveExperiment {
 public:
  explicit DriveExperiment(DriveExperimentOptions options);

  /// False for a frame that is left out.
  bool apply(ImageFrame* frame);

 private:
  const DriveExperimentOptions options_;
  std::optional<Timestamp> first_;
  std::optional<RigidTransform> before_carrying_;
  RigidTransform shown_from_true_odom_;
};

}  // namespace vcharge
