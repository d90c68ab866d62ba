#pragma once

#include <nav_msgs/OccupancyGrid.h>
#include <sensor_msgs/PointCloud2.h>
#include <vcharge_msgs/HeightMap.h>
#include <visualization_msgs/Marker.h>

#include "vcharge_core/base/timestamp.h"
#include "vcharge_core/dense_maps/height_map.h"

namespace vcharge {

/// All cells, exactly. Confidence is 1 where the map does not tell it.
vcharge_msgs::HeightMap toMessage(const HeightMap& map, Timestamp stamp);
/// InputError "<source>: ..." for cells that do not fit the sizes, or a grid that is not finite.
HeightMap fromMessage(const vcharge_msgs::HeightMap& message, const std::string& source);

/// The observed cells' centres as x, y, z (metres), intensity (gray, 0 to 255) and confidence, FLOAT32.
sensor_msgs::PointCloud2 makeHeightCloud(const HeightMap& map, Timestamp stamp);

/// 0 drivable, 100 obstacle, -1 unobserved. `states`: CV_8UC1 of CellState.
nav_msgs::OccupancyGrid makeOccupancyGrid(const HeightMap& map, const cv::Mat& states, Timestamp stamp);

/// Two triangles between each four observed neighbours, gray as the cameras saw them (white where the map
/// does not tell). Every `stride`-th cell, so that no more than `max_triangles` come.
visualization_msgs::Marker makeHeightMesh(const HeightMap& map, Timestamp stamp,
                                          size_t max_triangles = 400000);

}  // namespace vcharge
