#pragma once

#include <vector>

#include <opencv2/core.hpp>

#include "vcharge_core/camera/mei_camera.h"
#include "vcharge_core/camera/ray_table.h"
#include "vcharge_dense/plane_family.h"
#include "vcharge_dense/plane_sweep.h"
#include "vcharge_dense/plane_sweep_options.h"

namespace vcharge {

/// Treatment of image borders and windows without texture. kUnknown leaves them out. kAsTheAuthors reproduces
/// the authors' results: reads beyond a neighbour's border wrap around to the opposite one, the reference
/// repeats its last pixel beyond its border, and the correlation of a window without texture is 0.
enum class PlainBorder { kUnknown, kAsTheAuthors };

struct PlainResult {
  cv::Mat plane;             ///< CV_32SC1: best plane, counted over all families; -1 where none
  cv::Mat inverse_distance;  ///< CV_64FC1: distance of the plane, interpolated by a parabola; NaN where none
  cv::Mat inverse_range;     ///< CV_64FC1
  cv::Mat score;             ///< CV_64FC1, NaN if there is none
};

/// The simplest form of the plane sweep, as a reference for PlaneSweep's first sweep: double precision, no
/// tiles, threads, refinement or uncertainty.
PlainResult plainPlaneSweep(const MeiCamera& camera, const cv::Mat& valid_mask,
                            const std::vector<PlaneFamily>& families, const PlaneSweepOptions& options,
                            const SweepImage& reference, const std::vector<SweepImage>& neighbours,
                            PlainBorder border);

}  // namespace vcharge
