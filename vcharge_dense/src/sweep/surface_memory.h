#pragma once

#include <cstdint>
#include <vector>

#include <opencv2/core.hpp>

#include "sweep/sweep_level.h"
#include "vcharge_core/motion/rigid_transform.h"
#include "vcharge_dense/exposure.h"

namespace vcharge {

/// The surface that an earlier range map of the same camera predicts, and the tiles in which it is believed.
/// There the planes need not be swept: refineSurface() searches around the prediction.
class SurfaceMemory {
 public:
  /// `range_m`: the earlier range map (CV_32FC1), NaN where unknown. `exposure`: of the reference. `phase`
  /// counts the sweeps: it selects the tiles that are swept in full, so that what a prediction hides is
  /// found.
  SurfaceMemory(const SweepLevel& level, const cv::Mat& range_m, const RigidTransform& reference_from_earlier,
                const Exposure& exposure, uint32_t phase);

  /// Whether it predicts enough that CoarsePass need not find the surface by itself.
  bool predictsMuch() const { return predicts_much_; }

  /// Sets the estimate in the tiles in which the prediction is believed, with a score that every peak of the
  /// refinement replaces, and returns the other tiles, whose planes must be swept. `coarse` is the estimate
  /// of CoarsePass: where it is confident and contradicts the prediction, its surface is taken.
  std::vector<cv::Rect> apply(const SurfaceEstimate& coarse, const std::vector<cv::Rect>& tiles,
                              SurfaceEstimate* estimate) const;

 private:
  bool isBelieved(const SurfaceEstimate& coarse, const cv::Rect& tile) const;
  void setTile(const SurfaceEstimate& coarse, const cv::Rect& tile, SurfaceEstimate* estimate) const;

  const uint32_t phase_;
  cv::Mat inverse_range_;  // CV_32FC1, NaN where nothing is predicted
  bool predicts_much_ = false;
};

}  // namespace vcharge
