#pragma once

#include <memory>
#include <optional>
#include <vector>

#include <opencv2/core.hpp>

#include "kernels/half_resolution.h"
#include "sweep/sweep_level.h"

namespace vcharge {

/// Whether a pixel of the coarse pass is confident: its score is high and well above the second peak.
inline bool isConfident(float score, float second_score) {
  // Chosen on two simulated drives that are not used for evaluation.
  constexpr float kConfidentScore = 0.6f, kConfidentLead = 0.1f;
  return score >= kConfidentScore && score - second_score >= kConfidentLead;
}

/// What a coarse pass found, and the images in which it did.
struct CoarseSurface {
  SweepPixels pixels;
  SweepInput input;
  SurfaceEstimate estimate;
};

/// A sweep at half the resolution over every second plane. It selects the planes that each tile of the main
/// sweep needs: on two simulated drives a third of all planes, without loss of accuracy.
class CoarsePass {
 public:
  CoarsePass(std::shared_ptr<const SweepLevel> fine, const std::optional<Plane>& ground_in_camera);

  const SweepLevel& level() const { return *level_; }
  /// `half_pixels`: the halved images of `fine`. Where an earlier map predicts the surface, the images at
  /// every second baseline on each side of the reference suffice, from the shortest on, if at least two
  /// remain.
  CoarseSurface sweep(const SweepInput& fine, SweepPixels half_pixels, bool is_predicted) const;

  /// The planes of each tile: those near the planes that confident pixels in and around it found, or all
  /// planes if too few pixels are confident.
  std::vector<TilePlanes> choosePlanes(const SurfaceEstimate& coarse,
                                       const std::vector<cv::Rect>& tiles) const;

  /// Adds the second peaks of planes that were left out, with their scores from the coarse pass.
  void addSecondPeaks(const SurfaceEstimate& coarse, const std::vector<cv::Rect>& tiles,
                      const std::vector<TilePlanes>& choice, SurfaceEstimate* estimate) const;

 private:
  TilePlanes choosePlanes(const SurfaceEstimate& coarse, const cv::Rect& tile) const;

  const std::shared_ptr<const SweepLevel> fine_;
  std::unique_ptr<const SweepLevel> level_;
};

}  // namespace vcharge
