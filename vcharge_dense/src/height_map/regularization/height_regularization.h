#pragma once

#include "height_map/fusion/column_fusion.h"
#include "height_map/regularization/primal_dual.h"

namespace vcharge {

/// First pass: finds the observed cells (paper, E^Labeling), where the evidence for free space above the best
/// height exceeds gamma, with a cost for the length of the boundary. Returns CV_8UC1, 255 where observed.
cv::Mat labelObserved(const ColumnImages& columns, double gamma, PrimalDualReport* report);

/// Second pass: smooths the heights of the observed cells (paper, E^Height). Heights within half a voxel
/// (delta) of a column's best height cost nothing; observed cells without a surface follow their neighbours.
/// Returns CV_32FC1, NaN elsewhere.
cv::Mat smoothHeights(const ColumnImages& columns, const cv::Mat& observed, const VoxelGrid& grid,
                      PrimalDualReport* report);

}  // namespace vcharge
