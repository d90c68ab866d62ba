#pragma once

#include <vector>

#include <opencv2/core.hpp>

#include "vcharge_core/camera/mei_camera.h"
#include "vcharge_core/camera/ray_table.h"
#include "vcharge_dense/plane_family.h"
#include "vcharge_dense/plane_sweep.h"
#include "vcharge_dense/plane_sweep_options.h"

namespace vcharge {

/// What happens where an image does not tell. kUnknown leaves out what is not seen. kAsTheAuthors, for
/// comparison with their results: neighbours are read beyond their border from the opposite one, a window
/// over the reference's border repeats its last pixel (and meets what the pixels outside the image would
/// see), and the correlation of a window without texture is 0.
enum class PlainBorder { kUnknown, kAsTheAuthors };

struct PlainResult {
  cv::Mat plane;             ///< CV_32SC1, over all families; -1 where none
  cv::Mat inverse_distance;  ///< CV_64FC1: of the plane, by the parabola where the options ask for it; NaN
                             ///< where none
  cv::Mat inverse_range;     ///< CV_64FC1
  cv::Mat score;             ///< CV_64FC1, NaN where none
};

/// The plane sweep written down as plainly as possible, in double precision and without tiles, threads,
/// refinement, gates or uncertainty: what PlaneSweep's first sweep has to equal.
PlainResult plainPlaneSweep(const MeiCamera& camera, const cv::Mat& valid_mask,
                            const std::vector<PlaneFamily>& families, const PlaneSweepOptions& options,
                            const SweepImage& reference, const std::vector<SweepImage>& neighbours,
                            PlainBorder border);

}  // namespace vcharge
