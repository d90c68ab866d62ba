#include "vcharge_ros/sparse_map_conversions.h"

#include <cmath>
#include <limits>

#include <sensor_msgs/point_cloud2_iterator.h>

#include "vcharge_ros/conversions.h"

namespace vcharge {
namespace {

constexpr double kLineWidth_m = 0.15;

visualization_msgs::Marker makeEdges(const SparseMap& map, bool accepted, const std::string& frame_id) {
  visualization_msgs::Marker marker;
  marker.header.frame_id = frame_id;
  marker.ns = accepted ? "accepted" : "rejected";
  marker.type = visualization_msgs::Marker::LINE_LIST;
  marker.pose.orientation.w = 1.0;
  marker.scale.x = kLineWidth_m;
  marker.color.r = accepted ? 0.1F : 1.0F;
  marker.color.g = accepted ? 0.9F : 0.2F;
  marker.color.b = 0.1F;
  marker.color.a = accepted ? 1.0F : 0.8F;
  for (const MapLoopEdge& edge : map.contents().loop_edges) {
    if (edge.accepted != accepted) {
      continue;
    }
    for (const int32_t keyframe : {edge.first, edge.second}) {
      marker.points.push_back(
          toPoseMessage(map.keyframes()[static_cast<size_t>(keyframe)].map_from_vehicle).position);
    }
  }
  marker.action =
      marker.points.empty() ? visualization_msgs::Marker::DELETE : visualization_msgs::Marker::ADD;
  return marker;
}

/// An empty cloud for this many points, with the fields of landmarks.
sensor_msgs::PointCloud2 makeEmptyCloud(size_t num_points, const std::string& frame_id) {
  sensor_msgs::PointCloud2 cloud;
  cloud.header.frame_id = frame_id;
  sensor_msgs::PointCloud2Modifier modifier(cloud);
  constexpr auto kFloat = sensor_msgs::PointField::FLOAT32;
  modifier.setPointCloud2Fields(5, "x", 1, kFloat, "y", 1, kFloat, "z", 1, kFloat, "observations", 1, kFloat,
                                "sigma_m", 1, kFloat);
  modifier.resize(num_points);
  return cloud;
}

}  // namespace

sensor_msgs::PointCloud2 makeLandmarkCloud(const SparseMap& map, const std::string& frame_id) {
  sensor_msgs::PointCloud2 cloud = makeEmptyCloud(map.landmarks().size(), frame_id);
  sensor_msgs::PointCloud2Iterator<float> values(cloud, "x");
  for (size_t i = 0; i < map.landmarks().size(); ++i, ++values) {
    const MapLandmark& landmark = map.landmarks()[i];
    const auto [begin, end] = map.observationsOfLandmark(i);
    const double variance_m2 = landmark.covariance_m2.trace();
    for (int k = 0; k < 3; ++k) {
      values[k] = static_cast<float>(landmark.position_m[k]);
    }
    values[3] = static_cast<float>(end - begin);
    values[4] = variance_m2 > 0.0 ? static_cast<float>(std::sqrt(variance_m2))
                                  : std::numeric_limits<float>::quiet_NaN();
  }
  return cloud;
}

sensor_msgs::PointCloud2 makeLandmarkCloud(const std::vector<Eigen::Vector3d>& positions_m,
                                           const std::string& frame_id) {
  sensor_msgs::PointCloud2 cloud = makeEmptyCloud(positions_m.size(), frame_id);
  sensor_msgs::PointCloud2Iterator<float> values(cloud, "x");
  for (const Eigen::Vector3d& position_m : positions_m) {
    for (int k = 0; k < 3; ++k) {
      values[k] = static_cast<float>(position_m[k]);
    }
    values[3] = values[4] = std::numeric_limits<float>::quiet_NaN();
    ++values;
  }
  return cloud;
}

nav_msgs::Path makePath(const SparseMap& map, const std::string& frame_id) {
  return makePath(trajectoryOf(map), frame_id);
}

nav_msgs::Path makePath(const Trajectory& trajectory, const std::string& frame_id) {
  nav_msgs::Path path;
  path.header.frame_id = frame_id;
  for (const StampedTransform& entry : trajectory) {
    geometry_msgs::PoseStamped pose;
    pose.header.frame_id = frame_id;
    pose.header.stamp = fromTimestamp(entry.stamp);
    pose.pose = toPoseMessage(entry.world_from_vehicle);
    path.poses.push_back(pose);
  }
  return path;
}

visualization_msgs::MarkerArray makeLoopEdgeMarkers(const SparseMap& map, const std::string& frame_id) {
  visualization_msgs::MarkerArray markers;
  markers.markers = {makeEdges(map, true, frame_id), makeEdges(map, false, frame_id)};
  return markers;
}

}  // namespace vcharge
