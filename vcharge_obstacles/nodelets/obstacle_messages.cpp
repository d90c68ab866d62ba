#include "obstacle_messages.h"

#include <algorithm>
#include <cmath>
#include <limits>

#include <octomap/OcTree.h>

#include "marker_shapes.h"
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

visualization_msgs::Marker makeMarker(const ObstacleMap& map, const char* name, int type, double scale) {
  visualization_msgs::Marker marker = makeMarker(map.stamp, map.frame_id, name, type);
  marker.scale.x = marker.scale.y = marker.scale.z = scale;
  marker.color.r = 1.0F;
  return marker;
}

}  // namespace

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
