#include "obstacle_messages.h"

#include <cmath>
#include <limits>
#include <memory>

#include "vcharge_core/error.h"
#include "vcharge_core/working_camera.h"
#include "vcharge_obstacles/obstacle_outlines.h"
#include "vcharge_ros/conversions.h"

namespace vcharge {
namespace {

/// A float image that keeps its message alive, as OpenCV's own reference count.
cv::Mat toFloatImage(const sensor_msgs::ImageConstPtr& message, const std::string& topic) {
  const size_t row_bytes = message->width * sizeof(float);
  if (message->encoding != "32FC1" || message->is_bigendian != 0 || message->step != row_bytes ||
      message->data.size() != row_bytes * message->height || message->data.empty()) {
    throw InputError(topic + ": expected 32FC1 images without padding, got " + message->encoding + " of " +
                     std::to_string(message->width) + "x" + std::to_string(message->height));
  }
  return cv::Mat(static_cast<int>(message->height), static_cast<int>(message->width), CV_32FC1,
                 const_cast<uint8_t*>(message->data.data()));  // nobody writes to it
}

std_msgs::ColorRGBA colourOf(double height_m) {
  std_msgs::ColorRGBA colour;  // yellow for kerbs to red for walls
  colour.r = 1.0F;
  colour.g = static_cast<float>(std::max(0.0, 1.0 - height_m));
  colour.a = 0.6F;
  return colour;
}

geometry_msgs::Point pointOf(const Eigen::Vector2d& place, double z_m) {
  geometry_msgs::Point point;
  point.x = place.x();
  point.y = place.y();
  point.z = z_m;
  return point;
}

visualization_msgs::Marker makeMarker(const ObstacleMap& map, const char* name, int type, double scale) {
  visualization_msgs::Marker marker;
  marker.header.stamp = fromTimestamp(map.stamp);
  marker.header.frame_id = map.frame_id;
  marker.ns = name;
  marker.type = type;
  marker.action = visualization_msgs::Marker::ADD;
  marker.pose.orientation.w = 1.0;
  marker.scale.x = marker.scale.y = marker.scale.z = scale;
  marker.color.r = marker.color.a = 1.0F;
  return marker;
}

}  // namespace

RangeMap toRangeMap(const sensor_msgs::ImageConstPtr& range, const sensor_msgs::ImageConstPtr& sigma,
                    const sensor_msgs::ImageConstPtr& confidence, const RigCamera& camera,
                    const std::string& topic) {
  const cv::Mat range_m = toFloatImage(range, topic);
  WorkingCameraOptions options;
  options.image_scale = static_cast<double>(range_m.cols) / camera.image_size_px.width;
  const WorkingCamera working(camera.model, camera.image_size_px, camera.field_of_view_rad, camera.mask,
                              options);
  if (working.size() != range_m.size() || sigma->width != range->width || sigma->height != range->height ||
      confidence->width != range->width || confidence->height != range->height) {
    throw InputError(topic + ": expected three images of " + std::to_string(working.size().width) + "x" +
                     std::to_string(working.size().height) + ", as camera '" + camera.name +
                     "' has it, got " + std::to_string(range_m.cols) + "x" + std::to_string(range_m.rows));
  }
  return {toTimestamp(range->header.stamp),
          camera.name,
          range->header.frame_id,
          working.model(),
          range_m,
          toFloatImage(sigma, topic),
          toFloatImage(confidence, topic)};
}

nav_msgs::OccupancyGrid toMessage(const ObstacleMap& map) {
  nav_msgs::OccupancyGrid grid;
  grid.header.stamp = fromTimestamp(map.stamp);
  grid.header.frame_id = map.frame_id;
  grid.info.map_load_time = grid.header.stamp;
  grid.info.resolution = static_cast<float>(map.cell_size_m);
  grid.info.width = static_cast<uint32_t>(map.state.cols);
  grid.info.height = static_cast<uint32_t>(map.state.rows);
  grid.info.origin.position = pointOf(map.origin_m, 0.0);
  grid.info.origin.orientation.w = 1.0;
  grid.data.reserve(map.state.total());
  for (int row = 0; row < map.state.rows; ++row) {
    const int8_t* cells = map.state.ptr<int8_t>(row);
    grid.data.insert(grid.data.end(), cells, cells + map.state.cols);
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
    if (marker.points.empty()) {  // rviz refuses markers without points
      marker.action = visualization_msgs::Marker::DELETE;
    }
    markers.markers.push_back(marker);
  }
  return markers;
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

}  // namespace vcharge
