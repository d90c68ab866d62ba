#pragma once

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
#include "vcharge_dense/plane_family.h"
#include "vcharge_dense/plane_sweep_options.h"

namespace vcharge {

class CoarsePass;
class FarPlanes;
class SweepLevel;
struct SurfaceEstimate;
struct SweepInput;
struct SweepPixels;

/// One image of the swept camera and where it was taken.
struct SweepImage {
  Timestamp stamp;
  cv::Mat pixels;  ///< CV_8UC1 of the working camera's size
  RigidTransform world_from_camera;
};

/// What a sweep knows besides the range map; of the sweep at full resolution alone.
struct SweepDetails {
  cv::Mat score;   ///< CV_32FC1: aggregated correlation of the chosen plane; NaN where no plane was scored
  cv::Mat plane;   ///< CV_32SC1: index of the best plane of the first sweep over all families, -1 where none
  cv::Mat voters;  ///< CV_32SC1: bit n is set where neighbour n took part in that score
};

/// Range by plane-sweeping stereo directly on fisheye images: for each pixel of the reference image the plane
/// on which the neighbours' windows correlate best with the reference's (Haene et al., 3DV 2014; paper,
/// section Depth Map Computation, equation (warping) with the camera's unified projection).
///
/// Which pixels take part: all that the valid mask names. A neighbour votes for a plane at a pixel when every
/// pixel of the window is seen by it: the four sensor pixels that each sample is interpolated from are valid
/// and inside its image. A reference pixel whose window touches an invalid pixel or the image's border is
/// unknown.
///
/// A range is also unknown where the window has no texture, where the best plane is the first or last of its
/// family (the surface may lie beyond), where the score is low, and where the standard deviation is too
/// large, as it is towards the direction of travel, where motion stereo is blind. With num_fill_levels such
/// pixels take the range of a sweep at a lower resolution, where that has one.
///
/// Immutable: one object serves any number of threads, and the result does not depend on theirs.
class PlaneSweep {
 public:
  /// camera: without distortion; valid_mask: CV_8UC1, not 0 where its pixels may be used (both of a
  /// WorkingCamera). ground_in_camera is needed for ground-parallel planes. std::invalid_argument for bad
  /// options or a missing or impossible ground, std::logic_error for a camera with distortion and
  /// images of less than 16 pixels a row.
  PlaneSweep(const MeiCamera& camera, const cv::Mat& valid_mask, const PlaneSweepOptions& options,
             const std::optional<Plane>& ground_in_camera = std::nullopt);

  /// Range map of `reference` (stamp, camera and images are set; the names are left empty). Neighbours with a
  /// later stamp count as after it. All ranges are unknown when there is no neighbour. std::logic_error for
  /// images of another size or type and for more than 32 neighbours.
  RangeMap sweep(const SweepImage& reference, const std::vector<SweepImage>& neighbours,
                 SweepDetails* details = nullptr) const;

  const PlaneSweepOptions& options() const;
  const std::vector<PlaneFamily>& families() const;

 private:
  SurfaceEstimate sweepPlanes(const SweepInput& input, const SweepPixels& half_pixels,
                              const std::vector<cv::Rect>& large_tiles) const;
  RangeMap sweep(const SweepInput& input, const SweepPixels& pixels, SweepDetails* details) const;

  std::shared_ptr<const SweepLevel> level_;
  std::shared_ptr<const CoarsePass> coarse_;  // null: all planes
  std::shared_ptr<const FarPlanes> far_;      // null: all at full resolution
  std::shared_ptr<const PlaneSweep> half_;    // null: what is unknown stays so
};

}  // namespace vcharge
