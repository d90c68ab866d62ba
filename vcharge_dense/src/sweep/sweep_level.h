#pragma once

#include <memory>
#include <optional>
#include <vector>

#include <opencv2/core.hpp>

#include "refinement/surface_estimate.h"
#include "sweep/sweep_input.h"
#include "vcharge_core/camera/mei_camera.h"
#include "vcharge_core/camera/ray_table.h"
#include "vcharge_dense/plane_family.h"
#include "vcharge_dense/plane_sweep_options.h"

namespace vcharge {

/// The planes that are swept in a tile, per family, see TileScores::slots.
using TilePlanes = std::vector<std::vector<int>>;

/// Everything common to the sweeps of one camera: its model without distortion and the planes to be swept.
/// Inputs refer to it. Thread safe. Keeps the working memory of tiles, a few megabytes per thread, because
/// new memory pages cost more time than the computation in them.
class SweepLevel {
 public:
  SweepLevel(const MeiCamera& camera, const cv::Mat& valid_mask, const PlaneSweepOptions& options,
             const std::optional<Plane>& ground_in_camera, const PlaneAxes& axes = opticalAxis());
  ~SweepLevel();
  SweepLevel(const SweepLevel&) = delete;
  SweepLevel& operator=(const SweepLevel&) = delete;

  /// Makes an input without neighbours.
  SweepInput makeInput(const cv::Mat& reference_pixels) const;

  /// Surface from the planes with the best scores. `choice` has one entry per tile, or is empty: all
  /// planes.
  SurfaceEstimate sweepPlanes(const SweepInput& input, const std::vector<cv::Rect>& tiles,
                              const std::vector<TilePlanes>& choice) const;
  /// The same, into an estimate, which keeps its values outside these tiles.
  void sweepPlanes(const SweepInput& input, const std::vector<cv::Rect>& tiles,
                   const std::vector<TilePlanes>& choice, SurfaceEstimate* estimate) const;
  /// Searches for better peaks around an estimate, see makeRefinement().
  void refineSurface(const SweepInput& input, const Hypotheses& refinement,
                     const std::vector<cv::Rect>& tiles, SurfaceEstimate* estimate) const;

  const MeiCamera& camera() const { return camera_; }
  const cv::Mat& validMask() const { return valid_mask_; }
  /// CV_8UC1: not 0 where all pixels of the window are valid.
  const cv::Mat& validWindows() const { return valid_windows_; }
  const PlaneSweepOptions& options() const { return options_; }
  const RayTable& rays() const { return rays_; }
  const PlaneAxes& axes() const { return axes_; }
  const std::vector<PlaneFamily>& families() const { return families_; }
  const std::vector<Hypotheses>& planes() const { return planes_; }  ///< planes of families()

 private:
  class WorkerPool;

  MeiCamera camera_;
  cv::Mat valid_mask_, valid_windows_;
  cv::Mat near_valid_;  // CV_8UC1: not 0 near valid pixels
  PlaneSweepOptions options_;
  PlaneAxes axes_;
  RayTable rays_;
  std::vector<PlaneFamily> families_;
  std::vector<Hypotheses> planes_;
  std::unique_ptr<WorkerPool> workers_;
};

}  // namespace vcharge
