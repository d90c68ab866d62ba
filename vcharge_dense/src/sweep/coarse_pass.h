#pragma once

#include <memory>
#include <optional>
#include <vector>

#include <opencv2/core.hpp>

#include "sweep/sweep_level.h"
#include "vcharge_dense/plane_sweep.h"

namespace vcharge {

/// A sweep at half the resolution, over every second plane, that tells which planes each tile of the sweep
/// proper needs.
class CoarsePass {
 public:
  CoarsePass(std::shared_ptr<const SweepLevel> fine, const std::optional<Plane>& ground_in_camera);

  const SweepLevel& level() const { return *level_; }
  /// half_input: of the level.
  SurfaceEstimate sweep(const SweepInput& half_input) const;

  /// Per tile the planes within some planes of what sure pixels in and around it found, or all where too few
  /// of them are sure.
  std::vector<TilePlanes> choosePlanes(const SurfaceEstimate& coarse,
                                       const std::vector<cv::Rect>& tiles) const;

  /// The second peaks of planes that were not swept: an estimate leads by no more than it leads those of the
  /// coarse pass.
  void addSecondPeaks(const SurfaceEstimate& coarse, const std::vector<cv::Rect>& tiles,
                      const std::vector<TilePlanes>& choice, SurfaceEstimate* estimate) const;

 private:
  TilePlanes choosePlanes(const SurfaceEstimate& coarse, const cv::Rect& tile) const;

  const std::shared_ptr<const SweepLevel> fine_;
  std::unique_ptr<const SweepLevel> level_;
};

}  // namespace vcharge
