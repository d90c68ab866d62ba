#include "vcharge_ros/obstacle_conversions.h"

#include <algorithm>
#include <cmath>

#include "vcharge_core/base/error.h"
#include "vcharge_ros/conversions.h"

namespace vcharge {
namespace {

/// An empty grid with the header, origin and resolution of a map.
template <class Map>
nav_msgs::OccupancyGrid makeGrid(const Map& map) {
  nav_msgs::OccupancyGrid grid;
  grid.header.stamp = fromTimestamp(map.stamp);
  grid.header.frame_id = map.frame_id;
  grid.info.map_load_time = grid.header.stamp;
  grid.info.resolution = static_cast<float>(map.cell_size_m);
  grid.info.origin.position.x = map.origin_m.x();
  grid.info.origin.position.y = map.origin_m.y();
  grid.info.origin.orientation.w = 1.0;
  return grid;
}

}  // namespace

nav_msgs::OccupancyGrid toMessage(const ObstacleMap& map) {
  nav_msgs::OccupancyGrid grid = makeGrid(map);
  grid.info.width = static_cast<uint32_t>(map.state.cols);
  grid.info.height = static_cast<uint32_t>(map.state.rows);
  grid.data.reserve(map.state.total());
  for (int row = 0; row < map.state.rows; ++row) {
    const int8_t* cells = map.state.ptr<int8_t>(row);
    grid.data.insert(grid.data.end(), cells, cells + map.state.cols);
  }
  return grid;
}

ObstacleMap fromMessage(const nav_msgs::OccupancyGrid& grid, const std::string& topic) {
  const auto& rotation = grid.info.origin.orientation;
  const bool is_turned = rotation.x != 0.0 || rotation.y != 0.0 || rotation.z != 0.0;
  constexpr uint32_t kMaxSide = 10000;
  if (grid.header.stamp.isZero() || grid.header.frame_id.empty() || !(grid.info.resolution > 0.0F) ||
      is_turned || grid.info.width > kMaxSide || grid.info.height > kMaxSide ||
      grid.data.size() != size_t{grid.info.width} * grid.info.height) {
    throw InputError(topic +
                     ": expected a stamp, a frame, a resolution above 0, an origin without rotation, and "
                     "width x height cells");
  }
  ObstacleMap map = ObstacleMap::unobserved(
      {static_cast<int>(grid.info.width), static_cast<int>(grid.info.height)}, grid.info.resolution);
  map.stamp = toTimestamp(grid.header.stamp);
  map.frame_id = grid.header.frame_id;
  map.origin_m = {grid.info.origin.position.x, grid.info.origin.position.y};
  std::copy(grid.data.begin(), grid.data.end(), map.state.begin<int8_t>());
  return map;
}

nav_msgs::OccupancyGrid toMessage(const StepMap& map) {
  nav_msgs::OccupancyGrid grid = makeGrid(map);
  grid.info.width = static_cast<uint32_t>(map.height_m.cols);
  grid.info.height = static_cast<uint32_t>(map.height_m.rows);
  grid.data.reserve(map.height_m.total());
  for (int row = 0; row < map.height_m.rows; ++row) {
    for (int column = 0; column < map.height_m.cols; ++column) {
      const float height_m = map.height_m.at<float>(row, column);
      grid.data.push_back(height_m > 0.0F        ? kCellOccupied
                          : std::isnan(height_m) ? kCellUnobserved
                                                 : kCellFree);
    }
  }
  return grid;
}

}  // namespace vcharge
