#include "localization_messages.h"

#include <cmath>
#include <limits>

#include "vcharge_core/base/error.h"
#include "vcharge_ros/conversions.h"

namespace vcharge {
namespace {

constexpr double kInitialSigma_m = 0.5;
constexpr double kInitialSigma_rad = 0.26;

std_msgs::ColorRGBA colourOf(size_t camera) {
  static const float colours[][3] = {
      {0.9F, 0.2F, 0.2F}, {0.2F, 0.7F, 0.3F}, {0.2F, 0.4F, 0.9F}, {0.9F, 0.7F, 0.1F}};
  const auto& rgb = colours[camera % 4];
  std_msgs::ColorRGBA colour;
  colour.r = rgb[0];
  colour.g = rgb[1];
  colour.b = rgb[2];
  colour.a = 0.6F;
  return colour;
}

geometry_msgs::Point toPoint(const Eigen::Vector3d& position) {
  geometry_msgs::Point point;
  point.x = position.x();
  point.y = position.y();
  point.z = position.z();
  return point;
}

}  // namespace

geometry_msgs::PoseWithCovarianceStamped toPoseMessage(const LocalizationResult& result,
                                                       const std::string& map_frame) {
  check(result.pose.has_value(), "toPoseMessage: expected a pose");
  geometry_msgs::PoseWithCovarianceStamped message;
  message.header.stamp = fromTimestamp(result.stamp);
  message.header.frame_id = map_frame;
  message.pose.pose = toPoseMessage(result.pose->map_from_vehicle);
  for (int row = 0; row < 6; ++row) {
    for (int column = 0; column < 6; ++column) {
      message.pose.covariance[static_cast<size_t>(6 * row + column)] = result.pose->covariance(row, column);
    }
  }
  return message;
}

vcharge_msgs::LocalizationStatus toStatusMessage(const LocalizationResult& result, const CameraRig& rig,
                                                 const std::string& map_frame) {
  vcharge_msgs::LocalizationStatus message;
  message.header.stamp = fromTimestamp(result.stamp);
  message.header.frame_id = map_frame;
  message.status = static_cast<uint8_t>(result.status);
  message.message = result.message;
  message.camera_warnings = result.camera_warnings;
  message.num_matches = static_cast<uint32_t>(result.fix.num_matches);
  message.num_inliers = static_cast<uint32_t>(result.fix.numInliers());
  for (size_t i = 0; i < rig.cameras.size(); ++i) {
    message.camera_names.push_back(rig.cameras[i].name);
    message.inliers_of_camera.push_back(
        i < result.fix.inliers_of_camera.size() ? static_cast<uint32_t>(result.fix.inliers_of_camera[i]) : 0);
  }
  message.second_best_ratio = result.fix.second_best_ratio;
  message.position_sigma_m = message.heading_sigma_rad = std::numeric_limits<double>::quiet_NaN();
  if (result.pose) {
    message.position_sigma_m = std::sqrt(result.pose->covariance.topLeftCorner<3, 3>().trace());
    message.heading_sigma_rad = std::sqrt(result.pose->covariance(5, 5));
  }
  message.since_fix_s = result.since_fix_s;
  return message;
}

visualization_msgs::Marker toObservationMarker(const LocalizationResult& result, const CameraRig& rig,
                                               const std::string& map_frame) {
  visualization_msgs::Marker marker;
  marker.header.stamp = fromTimestamp(result.stamp);
  marker.header.frame_id = map_frame;
  marker.ns = "observations";
  marker.type = visualization_msgs::Marker::LINE_LIST;
  marker.pose.orientation.w = 1.0;
  marker.scale.x = 0.01;
  if (!result.pose || result.fix.inliers.empty()) {
    marker.action = visualization_msgs::Marker::DELETE;
    return marker;
  }
  for (const auto& observation : result.fix.inliers) {
    const auto camera = static_cast<size_t>(observation.camera);
    marker.points.push_back(
        toPoint(result.pose->map_from_vehicle * rig.cameras[camera].vehicle_from_camera->translation()));
    marker.points.push_back(toPoint(observation.landmark_m));
    marker.colors.insert(marker.colors.end(), 2, colourOf(camera));
  }
  return marker;
}

PosePrior fromMessage(const geometry_msgs::PoseWithCovarianceStamped& message, const std::string& source,
                      const std::string& map_frame) {
  if (message.header.frame_id != map_frame) {
    throw InputError(source + ": expected the frame " + map_frame + ", not " + message.header.frame_id);
  }
  PosePrior prior;
  prior.map_from_vehicle = fromMessage(message.pose.pose, source);
  for (int row = 0; row < 6; ++row) {
    for (int column = 0; column < 6; ++column) {
      prior.covariance(row, column) = message.pose.covariance[static_cast<size_t>(6 * row + column)];
    }
  }
  if (!prior.covariance.allFinite() || prior.covariance.diagonal().minCoeff() < 0.0) {
    throw InputError(source + ": expected a finite covariance");
  }
  // "2D Pose Estimate" of rviz sets only the variances of x, y and yaw.
  for (int i = 0; i < 6; ++i) {
    if (prior.covariance(i, i) == 0.0) {
      const double sigma = i < 3 ? kInitialSigma_m : kInitialSigma_rad;
      prior.covariance(i, i) = i == 3 || i == 4 ? 0.01 * sigma * sigma : sigma * sigma;
    }
  }
  return prior;
}

}  // namespace vcharge
