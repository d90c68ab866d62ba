#pragma once

#include <vector>

#include <Eigen/Core>
#include <opencv2/core.hpp>

#include "kernels/packed_image.h"
#include "kernels/sweep_kernels.h"
#include "vcharge_core/camera/mei_camera.h"
#include "vcharge_core/camera/ray_table.h"
#include "vcharge_dense/exposure.h"
#include "vcharge_dense/plane_sweep_options.h"

namespace vcharge {

struct SweepNeighbour {
  PackedImage image;
  MeiCamera camera;
  Eigen::Matrix3f neighbour_from_reference;  ///< rotation
  Eigen::Vector3f translation_m;             ///< translation of the same transform
  bool after = false;                        ///< taken after the reference
  NeighbourNoise noise;
  cv::Mat other_mask;  ///< valid pixels of another camera than the reference's; otherwise empty
  Exposure exposure;
  Exposure reference_exposure;
  double reference_xi = 0.0;  ///< of the reference's camera

  Projection projection() const;
};

/// The reference image in the form that the kernels use.
struct SweepReference {
  cv::Mat samples;            ///< CV_16SC1, see SampleScale
  cv::Mat mean;               ///< CV_32FC1: mean of the window around each pixel
  cv::Mat inverse_deviation;  ///< CV_32FC1: 1 / sqrt(sum of squares about the mean), NaN without texture

  /// `pixels`: CV_8UC1. Windows that leave the image have no texture.
  SweepReference(const cv::Mat& pixels, const PlaneSweepOptions& options, const SampleScale& scale);
};

/// Input common to all tiles of one sweep. The pointers must outlive it.
struct SweepInput {
  MeiCamera camera;
  const RayTable* rays;
  const cv::Mat* near_valid;  ///< CV_8UC1: not 0 near valid pixels, where node grids need positions
  const PlaneSweepOptions* options;
  SweepKernels kernels;
  SampleScale scale;
  SweepReference reference;
  std::vector<SweepNeighbour> neighbours;
};

/// A set of surfaces to be scored: on surface k a pixel has the inverse range base + offsets[k] * weight. For
/// planes base is 0 and weight is -normal . ray.
struct Hypotheses {
  bool are_planes = false;
  Eigen::Vector3f normal = Eigen::Vector3f::Zero();  ///< only for planes
  cv::Mat base;                                      ///< CV_32FC1, empty for planes
  cv::Mat weight;                                    ///< CV_32FC1, NaN where there is no surface
  cv::Mat window_counts;  ///< CV_8UC1: not 0 where all pixels of the window are valid and have a surface
  std::vector<float> offsets;
  bool are_uniform = true;  ///< offsets are equally spaced

  /// Number of equal steps from the middle hypothesis to both ends if a StepTable holds all of them;
  /// otherwise 0.
  int stepReach() const {
    const size_t reach = offsets.size() / 2;
    const bool fits = !are_planes && are_uniform && offsets.size() % 2 != 0 && reach <= kMaxStepReach;
    return fits ? static_cast<int>(reach) : 0;
  }
  /// Mean distance of an offset from its neighbours.
  float stepAt(size_t hypothesis) const {
    const size_t last = offsets.size() - 1;
    const size_t before = are_uniform ? 0 : hypothesis - (hypothesis > 0 ? 1 : 0);
    const size_t after = are_uniform ? 1 : hypothesis + (hypothesis < last ? 1 : 0);
    return (offsets[after] - offsets[before]) / static_cast<float>(after - before);
  }
};

/// CV_8UC1: not 0 if all pixels of the window around a pixel are not 0 in `counts`.
cv::Mat windowsInside(const cv::Mat& counts, int window_px);

}  // namespace vcharge
