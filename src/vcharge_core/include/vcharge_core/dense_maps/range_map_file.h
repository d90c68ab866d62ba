#pragma once

#include <string>
#include <vector>

#include "vcharge_core/dense_maps/range_map.h"

namespace vcharge {

/// Range maps on disk: FOLDER/<camera>/<stamp_ns>_{range,sigma,confidence}.tiff (CV_32FC1) and
/// FOLDER/<camera>/<stamp_ns>.yaml (frame, working camera, content hash), written last, so that a map whose
/// YAML exists is complete.
void writeRangeMap(const RangeMap& map, const std::string& folder);

/// Names of the cameras (sub-folders with range maps), sorted.
std::vector<std::string> listRangeMapCameras(const std::string& folder);
/// Stamps of one camera's maps, sorted.
std::vector<Timestamp> listRangeMaps(const std::string& folder, const std::string& camera_name);
/// Throws InputError naming the file that is missing or has a different size.
RangeMap readRangeMap(const std::string& folder, const std::string& camera_name, Timestamp stamp);

/// Colours by inverse range, red near to blue far; black where unknown. CV_8UC3 (BGR).
cv::Mat colourRange(const cv::Mat& range_m, double min_range_m, double max_range_m);

}  // namespace vcharge
