#pragma once

#include <cstddef>
#include <optional>
#include <utility>
#include <vector>

#include "vcharge_core/frames/frame_assembler.h"

namespace vcharge {

/// Changes to a recorded drive that test the robustness of localization. Times are seconds since its first
/// frame.
struct DriveExperimentOptions {
  std::vector<size_t> cameras;                       ///< indices of the used cameras; empty: all
  std::optional<std::pair<double, double>> cover_s;  ///< interval in which all cameras are covered
  /// Interval in which the vehicle is carried away without images or odometry.
  std::optional<std::pair<double, double>> carry_s;
};

/// Changes a drive's frames one by one, in order.
class DriveExperiment {
 public:
  explicit DriveExperiment(DriveExperimentOptions options);

  /// Returns false for a frame that is left out.
  bool apply(ImageFrame* frame);

 private:
  const DriveExperimentOptions options_;
  std::optional<Timestamp> first_;
  std::optional<RigidTransform> before_carrying_;
  RigidTransform shown_from_true_odom_;
};

}  // namespace vcharge
