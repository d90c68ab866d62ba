#include "obstacle_messages.h"

#include <algorithm>
#include <cmath>
#include <limits>

#include <octomap/OcTree.h>

#include "marker_shapes.h"
#include "vcharge_core/base/error.h"
#include "vcharge_core/base/text_format.h"
#include "vcharge_obstacles/obstacle_outlines.h"
#include "vcharge_ros/conversions.h"

namespace vcharge {
namespace {

std_msgs::ColorRGBA colourOf(double height_m) {
  std_msgs::ColorRGBA colour;  // from yellow (kerbs) to red (walls)
  colour.r = 1.0F;
  colour.g = static_cast<float>(std::max(0.0, 1.0 - height_m));
  colour.a = 0.6F;
  return colour;
}

/// An empty grid with the header, origin and resolution of a map.
template <class Map>
nav_msgs::OccupancyGrid makeGrid(const Map& map) {
  nav_msgs::OccupancyGrid grid;
  grid.header.stamp = fromTimestamp(map.stamp);
  grid.header.frame_id = map.frame_id;
  grid.info.map_load_time = grid.header.stamp;
  grid.info.resolution = static_cast<float>(map.cell_size_m);
  grid.info.origin.position = pointOf(map.origin_m, 0.0);
  grid.info.origin.orientation.w = 1.0;
  return grid;
}

visualization_msgs::Marker makeMarker(const ObstacleMap& map, const char* name, int type, double scale) {
  visualization_msgs::Marker marker = makeMarker(map.stamp, map.frame_id, name, type);
  marker.scale.x = marker.scale.y = marker.scale.z = scale;
  marker.color.r = 1.0F;
  return marker;
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

sensor_msgs::LaserScan toMessage(const ObstacleScan& scan, const std::string& frame_id) {
  sensor_msgs::LaserScan message;
  message.header.stamp = fromTimestamp(scan.stamp);
  message.header.frame_id = frame_id;
  message.angle_min = static_cast<float>(scan.angle_min_rad);
  message.angle_increment = static_cast<float>(scan.angle_increment_rad);
  message.angle_max = static_cast<float>(scan.angle_rad(scan.size() - 1));
  message.range_min = 0.05F;
  message.range_max = static_cast<float>(scan.max_range_m);
  for (size_t i = 0; i < scan.size(); ++i) {
    const bool all_free = std::isnan(scan.range_m[i]) && scan.free_m[i] >= 0.95 * scan.max_range_m;
    message.ranges.push_back(all_free ? std::numeric_limits<float>::infinity() : scan.range_m[i]);
    message.intensities.push_back(std::isnan(scan.height_m[i]) ? 0.0F : scan.height_m[i]);
  }
  return message;
}

visualization_msgs::MarkerArray toMarkers(const ObstacleMap& map) {
  visualization_msgs::Marker walls = makeMarker(map, "walls", visualization_msgs::Marker::TRIANGLE_LIST, 1.0);
  visualization_msgs::Marker lines = makeMarker(map, "outlines", visualization_msgs::Marker::LINE_LIST, 0.03);
  for (const ObstacleOutline& outline : findOutlines(map)) {
    const std_msgs::ColorRGBA colour = colourOf(outline.height_m);
    for (size_t i = 0; i < outline.corners_m.size(); ++i) {
      const Eigen::Vector2d& a = outline.corners_m[i];
      const Eigen::Vector2d& b = outline.corners_m[(i + 1) % outline.corners_m.size()];
      const double top_m = outline.height_m;
      for (const geometry_msgs::Point& corner : {pointOf(a, 0.0), pointOf(b, 0.0), pointOf(b, top_m),
                                                 pointOf(a, 0.0), pointOf(b, top_m), pointOf(a, top_m)}) {
        walls.points.push_back(corner);
        walls.colors.push_back(colour);
      }
      lines.points.push_back(pointOf(a, 0.02));
      lines.points.push_back(pointOf(b, 0.02));
    }
  }
  visualization_msgs::MarkerArray markers;
  for (visualization_msgs::Marker& marker : std::vector<visualization_msgs::Marker>{walls, lines}) {
    if (marker.points.empty()) {  // rviz rejects markers without points
      marker.action = visualization_msgs::Marker::DELETE;
    }
    markers.markers.push_back(marker);
  }
  return markers;
}

std::unique_ptr<octomap::OcTree> toOctree(const ObstacleMap& map) {
  auto tree = std::make_unique<octomap::OcTree>(map.cell_size_m);
  const auto setVoxel = [&](int column, int row, int layer, float log_odds) {
    const Eigen::Vector2d middle = map.origin_m + map.cell_size_m * Eigen::Vector2d(column + 0.5, row + 0.5);
    tree->setNodeValue(middle.x(), middle.y(), (layer + 0.5) * map.cell_size_m, log_odds, true);
  };
  for (int row = 0; row < map.state.rows; ++row) {
    for (int column = 0; column < map.state.cols; ++column) {
      const int8_t state = map.state.at<int8_t>(row, column);
      if (state == kCellFree) {
        setVoxel(column, row, 0, tree->getClampingThresMinLog());
      } else if (state == kCellOccupied) {
        const double layers = std::ceil(map.height_m.at<float>(row, column) / map.cell_size_m - 1e-3);
        for (int layer = 0; layer < std::max(1, static_cast<int>(layers)); ++layer) {
          setVoxel(column, row, layer, tree->getClampingThresMaxLog());
        }
      }
    }
  }
  tree->updateInnerOccupancy();
  return tree;
}

geometry_msgs::Vector3Stamped toMessage(const GroundPlane& ground, Timestamp stamp,
                                        const std::string& vehicle_frame) {
  geometry_msgs::Vector3Stamped message;
  message.header.stamp = fromTimestamp(stamp);
  message.header.frame_id = vehicle_frame;
  message.vector.x = ground.roll_rad();
  message.vector.y = ground.pitch_rad();
  message.vector.z = ground.height_m();
  return message;
}

DriveMonitor::Report toReport(const ObstacleCameraStatus& status) {
  const bool works =
      status.state == ObstacleCameraState::kMapping || status.state == ObstacleCameraState::kStanding;
  DriveMonitor::Report report;
  report.level = works ? DriveMonitor::Level::kOk : DriveMonitor::Level::kWarn;
  report.message = status.camera_name + ": " + status.message;
  report.values = {{"state", toString(status.state)},
                   {"range_maps", std::to_string(status.range_maps)},
                   {"without_pose", std::to_string(status.without_pose)},
                   {"late", std::to_string(status.late)},
                   {"image_lag_s", toText(status.image_lag_s, 3)},
                   {"ground", toString(status.ground.state)},
                   {"pitch_rad", toText(status.ground.pitch_rad(), 4)},
                   {"roll_rad", toText(status.ground.roll_rad(), 4)},
                   {"height_m", toText(status.ground.height_m(), 3)}};
  return report;
}

}  // namespace vcharge
