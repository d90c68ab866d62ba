#pragma once

#include "height_map/fusion/column_fusion.h"
#include "height_map/regularization/primal_dual.h"

namespace vcharge {

/// First pass: which cells were observed (paper, E^Labeling). A cell is observed where that is cheaper than
/// not: where the free space above its best height outweighs gamma, but for the boundary's length. CV_8UC1,
/// 255 where observed.
cv::Mat labelObserved(const ColumnImages& columns, const HeightRegularizationOptions& options,
                      PrimalDualReport* report);

/// Second pass: heights of the observed cells (paper, E^Height), with the flat-bottomed cost about each
/// column's best height, delta half a voxel. Observed cells that saw no surface follow their neighbours.
/// CV_32FC1, NaN elsewhere.
cv::Mat smoothHeights(const ColumnImages& columns, const cv::Mat& observed, const VoxelGrid& grid,
                      const HeightRegularizationOptions& options, PrimalDualReport* report);

}  // namespace vcharge
