#pragma once

#include <memory>
#include <optional>
#include <vector>

#include "sweep/coarse_pass.h"
#include "sweep/sweep_level.h"

namespace vcharge {

/// Sweeps the fronto-parallel planes beyond PlaneSweepOptions::half_resolution_beyond_m at half the
/// resolution.
class FarPlanes {
 public:
  FarPlanes(std::shared_ptr<const SweepLevel> fine, const std::optional<Plane>& ground_in_camera);

  /// False where no plane lies beyond.
  bool any() const { return num_far_ > 0; }

  const SweepLevel& level() const { return *level_; }
  /// Of the half image.
  const std::vector<cv::Rect>& tiles() const { return tiles_; }

  /// The same in the fine image.
  std::vector<cv::Rect> tilesOfFine() const;

  /// The far ones of each tile's planes, and the next one for the peak's neighbour.
  std::vector<TilePlanes> farOf(const std::vector<TilePlanes>& choice) const;
  /// The others, and one for the peak's neighbour.
  std::vector<TilePlanes> nearOf(const std::vector<TilePlanes>& choice) const;

  /// Takes the far surface where it has the better peak, or the near planes have none inside them.
  void merge(const SweepInput& input, const SurfaceEstimate& far, SurfaceEstimate* estimate) const;

 private:
  const std::shared_ptr<const SweepLevel> fine_;
  std::unique_ptr<const SweepLevel> level_;
  std::vector<cv::Rect> tiles_;
  int num_far_ = 0;  // planes: the first ones of the first family
};

/// All planes of a level, for every tile.
std::vector<TilePlanes> allPlanes(const SweepLevel& level, size_t num_tiles);

}  // namespace vcharge
