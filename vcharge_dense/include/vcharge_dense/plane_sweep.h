#pragma once

#include <cstdint>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include <Eigen/Core>
#include <opencv2/core.hpp>

#include "vcharge_core/base/timestamp.h"
#include "vcharge_core/camera/mei_camera.h"
#include "vcharge_core/dense_maps/range_map.h"
#include "vcharge_core/motion/rigid_transform.h"
#include "vcharge_dense/exposure.h"
#include "vcharge_dense/plane_family.h"
#include "vcharge_dense/plane_sweep_options.h"

namespace vcharge {

class CoarsePass;
struct CoarseSurface;
class SurfaceMemory;
class SweepLevel;
struct SurfaceEstimate;
struct SweepInput;
struct SweepPixels;

/// A camera without distortion and the pixels that may be used (CV_8UC1 of its images' size, not 0 there).
struct SweepCamera {
  MeiCamera model;
  cv::Mat valid_mask;
};

/// One image and its pose.
struct SweepImage {
  Timestamp stamp;
  cv::Mat pixels;  ///< CV_8UC1, size of the working camera
  RigidTransform world_from_camera;
  /// Camera of a neighbour; null: the swept camera.
  std::shared_ptr<const SweepCamera> camera = nullptr;
  NeighbourNoise noise = {};
  Exposure exposure = {};
};

/// An earlier range map of the swept camera, which predicts the next one.
struct RememberedRanges {
  cv::Mat range_m;  ///< CV_32FC1 of the camera's size, NaN where unknown
  RigidTransform world_from_camera;
  uint32_t num_sweeps = 0;  ///< selects the tiles that are swept in full
};

/// Intermediate results of the sweep at full resolution, for tests and figures.
struct SweepDetails {
  cv::Mat score;   ///< CV_32FC1: aggregated correlation of the chosen plane; NaN where no plane was scored
  cv::Mat plane;   ///< best plane of the first sweep, counted over all families; -1 if none
  cv::Mat voters;  ///< CV_32SC1: bit n is set where neighbour n contributed to that score
};

/// Plane-sweeping stereo directly on fisheye images: finds for each pixel of the reference image the plane on
/// which the neighbours' windows correlate best with the reference's (Haene et al., 3DV 2014; paper, section
/// Depth Map Computation, equation (warping) with the camera's unified projection).
///
/// A neighbour contributes to the score of a plane at a pixel where it sees every pixel of the window: the
/// four pixels that each sample is interpolated from are valid and inside its image. A reference pixel whose
/// window touches an invalid pixel or the image's border is unknown.
///
/// A range is also unknown where the window has no texture, where the best plane is the first or last of its
/// family (the surface may lie beyond it), where the score is low, and where the standard deviation is large,
/// as towards the direction of travel, where points hardly move in the image. With num_fill_levels such
/// pixels are filled with the range of a sweep at a lower resolution, with coarse_pass that of the coarse
/// pass.
///
/// Immutable: any number of threads may use one object, and results do not depend on their number.
class PlaneSweep {
 public:
  /// `camera` has no distortion; `valid_mask`: CV_8UC1, not 0 where pixels may be used (both from a
  /// WorkingCamera). Planes parallel to the ground need `ground_in_camera`. Throws std::invalid_argument for
  /// bad options or a missing or impossible ground, std::logic_error for a camera with distortion and images
  /// less than 16 pixels wide. `axes`: of the families of upright planes.
  PlaneSweep(const MeiCamera& camera, const cv::Mat& valid_mask, const PlaneSweepOptions& options,
             const std::optional<Plane>& ground_in_camera = std::nullopt,
             const PlaneAxes& axes = opticalAxis());

  /// Range map of `reference` as seen from its pose: stamp, camera and images are set, names are left empty.
  /// If it was exposed in lines on the move, its pixels are moved to where they would be at the stamp. With
  /// `remembered` and coarse_pass, planes are swept only in tiles whose prediction has gaps or jumps or
  /// contradicts the coarse pass, and in one of six in turn; elsewhere the second sweep searches around the
  /// prediction. Neighbours with a later stamp count as after it. Without neighbours all ranges are unknown.
  /// Throws std::logic_error for images of another size or type and for more than 32 neighbours.
  RangeMap sweep(const SweepImage& reference, const std::vector<SweepImage>& neighbours,
                 SweepDetails* details = nullptr, const RememberedRanges* remembered = nullptr) const;

  const PlaneSweepOptions& options() const;
  const std::vector<PlaneFamily>& families() const;

 private:
  SurfaceEstimate sweepPlanes(const SweepInput& input, const SurfaceEstimate& coarse,
                              const SurfaceMemory* memory) const;
  RangeMap sweep(const SweepInput& input, const SweepPixels& pixels, SweepDetails* details,
                 const SurfaceMemory* memory) const;
  RangeMap rangeMap(const SweepInput& input, SurfaceEstimate* estimate) const;  // refines the estimate
  RangeMap rangeMap(CoarseSurface* surface) const;  // of a coarse pass at this resolution

  std::shared_ptr<const SweepLevel> level_;
  std::shared_ptr<const CoarsePass> coarse_;  // null: all planes are swept everywhere
  std::shared_ptr<const PlaneSweep> half_;    // null: unknown pixels are not filled
};

}  // namespace vcharge
