#pragma once

#include <functional>
#include <vector>

#include "height_map/fusion/packed_range_map.h"
#include "vcharge_core/dense_maps/height_map.h"

namespace vcharge {

/// Brightness of each observed cell (CV_8UC1; 0 elsewhere), as the mean over the views that see its surface,
/// nearer ones counting more. `images`: the undistorted image (CV_8UC1) of a view, in the views' order.
cv::Mat colourCells(const HeightMap& map, size_t num_views,
                    const std::function<void(size_t view, PackedRangeMap* range, cv::Mat* image)>& load_view,
                    double max_range_m);

}  // namespace vcharge
