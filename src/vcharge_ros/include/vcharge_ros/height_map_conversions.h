#pragma once

#include <nav_msgs/OccupancyGrid.h>
#include <sensor_msgs/PointCloud2.h>
#include <vcharge_msgs/HeightMap.h>
#include <visualization_msgs/Marker.h>

#include "vcharge_core/base/timestamp.h"
#include "vcharge_core/dense_maps/height_map.h"

namespace vcharge {

/// Converts all cells exactly. The confidence is 1 if the map has none.
vcharge_msgs::HeightMap toMessage(const HeightMap& map, Timestamp stamp);
/// Throws InputError "<source>: ..." if the cells do not match the sizes or the grid is not finite.
HeightMap fromMessage(const vcharge_msgs::HeightMap& message, const std::string& source);

/// Cloud of the observed cells' centres: x, y, z (metres), intensity (0 to 255) and confidence, FLOAT32.
sensor_msgs::PointCloud2 makeHeightCloud(const HeightMap& map, Timestamp stamp);

/// Grid with 0 for drivable, 100 for obstacle and -1 for unobserved cells. `states`: CV_8UC1 of CellState.
nav_msgs::OccupancyGrid makeOccupancyGrid(const HeightMap& map, const cv::Mat& states, Timestamp stamp);

/// Mesh of two triangles between four observed neighbours, gray as seen by the cameras (white if unknown).
/// Skips cells regularly so that there are at most `max_triangles`.
visualization_msgs::Marker makeHeightMesh(const HeightMap& map, Timestamp stamp,
                                          size_t max_triangles = 400000);

}  // namespace vcharge
