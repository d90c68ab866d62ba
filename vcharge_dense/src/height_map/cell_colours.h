#pragma once

#include <functional>
#include <vector>

#include "height_map/fusion/packed_range_map.h"
#include "vcharge_core/dense_maps/height_map.h"

namespace vcharge {

/// Gray level of each cell with a height (CV_8UC1; 0 elsewhere): mean over the views that see its surface,
/// nearer views weighted more. `load_view` returns a view's range map and undistorted image (CV_8UC1); views
/// are loaded in order.
cv::Mat colourCells(const HeightMap& map, size_t num_views,
                    const std::function<void(size_t view, PackedRangeMap* range, cv::Mat* image)>& load_view,
                    double max_range_m);

}  // namespace vcharge
