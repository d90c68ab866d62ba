#include "calibration_messages.h"

#include <array>
#include <cmath>
#include <limits>
#include <string>

#include <sensor_msgs/point_cloud2_iterator.h>

#include "vcharge_core/base/text_format.h"
#include "vcharge_ros/conversions.h"

namespace vcharge {
namespace {

constexpr double kPyramid_m = 0.5;  // height of a camera's pyramid
constexpr double kLetter_m = 0.35;

std::array<uint8_t, 3> rgbOf(size_t camera) {
  const auto value = static_cast<uint32_t>(std::stoul(colourOfCamera(camera).substr(1), nullptr, 16));
  return {static_cast<uint8_t>(value >> 16), static_cast<uint8_t>(value >> 8 & 255U),
          static_cast<uint8_t>(value & 255U)};
}

vcharge_msgs::CameraUncertainty toMessage(const CameraOutlook& outlook, const CameraCalibration* calibrated) {
  vcharge_msgs::CameraUncertainty message;
  message.camera = outlook.name;
  message.num_motions = static_cast<uint32_t>(std::max(0, outlook.hand_eye.num_motions));
  message.is_prediction = calibrated == nullptr ? 1 : 0;
  message.is_enough = calibrated != nullptr || outlook.is_enough ? 1 : 0;
  const Eigen::Matrix<double, 6, 1> sigma =
      calibrated == nullptr ? outlook.sigma
                            : Eigen::Matrix<double, 6, 1>(calibrated->covariance.diagonal().cwiseSqrt());
  message.x_m = sigma[0];
  message.y_m = sigma[1];
  message.z_m = sigma[2];
  message.roll_rad = sigma[3];
  message.pitch_rad = sigma[4];
  message.yaw_rad = sigma[5];
  return message;
}

uint8_t stateOf(const RigCalibrationSession::Status& status) {
  using Phase = RigCalibrationSession::Phase;
  switch (status.phase) {
    case Phase::kFollowing:
      return status.outlook.isEnough() ? vcharge_msgs::CalibrationStatus::READY
                                       : vcharge_msgs::CalibrationStatus::COLLECTING;
    case Phase::kCalibrating:
      return vcharge_msgs::CalibrationStatus::CALIBRATING;
    case Phase::kCalibrated:
      return vcharge_msgs::CalibrationStatus::DONE;
    case Phase::kFailed:
      break;
  }
  return vcharge_msgs::CalibrationStatus::FAILED;
}

geometry_msgs::Point toPoint(const Eigen::Vector3d& position) {
  return toPoseMessage(RigidTransform(Eigen::Quaterniond::Identity(), position)).position;
}

}  // namespace

vcharge_msgs::CalibrationStatus toStatusMessage(const RigCalibrationSession::Status& status) {
  constexpr double kNaN = std::numeric_limits<double>::quiet_NaN();
  const bool is_done = status.phase == RigCalibrationSession::Phase::kCalibrated && status.result != nullptr;
  vcharge_msgs::CalibrationStatus message;
  message.subject = "rig";
  message.state = stateOf(status);
  message.message = status.message;
  message.missing = status.outlook.missing;
  message.covered_fraction = kNaN;
  message.progress = status.progress;
  message.rms_px = is_done ? status.result->rms_px : kNaN;
  message.next = status.outlook.next;
  message.distance_m = status.outlook.distance_m;
  message.left_turn_rad = status.outlook.left_turn_rad;
  message.right_turn_rad = status.outlook.right_turn_rad;
  message.revisited_m = status.outlook.revisited_m;
  for (const auto& [name, count] : status.counts) {
    message.num_views = name == "keyframes" ? static_cast<uint32_t>(count) : message.num_views;
  }
  for (size_t i = 0; i < status.outlook.cameras.size(); ++i) {
    message.cameras.push_back(
        toMessage(status.outlook.cameras[i], is_done ? &status.result->cameras[i] : nullptr));
  }
  return message;
}

sensor_msgs::PointCloud2 toCloud(const LandmarksByCamera& landmarks, const std::string& frame_id) {
  size_t num_points = 0;
  for (const auto& points : landmarks) {
    num_points += points.size();
  }
  sensor_msgs::PointCloud2 cloud;
  cloud.header.frame_id = frame_id;
  sensor_msgs::PointCloud2Modifier modifier(cloud);
  modifier.setPointCloud2FieldsByString(2, "xyz", "rgb");
  modifier.resize(num_points);
  sensor_msgs::PointCloud2Iterator<float> xyz(cloud, "x");
  sensor_msgs::PointCloud2Iterator<uint8_t> blue(cloud, "b"), green(cloud, "g"), red(cloud, "r");
  for (size_t i = 0; i < landmarks.size(); ++i) {
    const auto rgb = rgbOf(i);
    for (const Eigen::Vector3d& point : landmarks[i]) {
      for (int k = 0; k < 3; ++k) {
        xyz[k] = static_cast<float>(point[k]);
      }
      *red = rgb[0];
      *green = rgb[1];
      *blue = rgb[2];
      ++xyz, ++red, ++green, ++blue;
    }
  }
  return cloud;
}

visualization_msgs::MarkerArray toCameraMarkers(const CameraRig& rig, const RigidTransform& map_from_vehicle,
                                                const vcharge_msgs::CalibrationStatus& status,
                                                const std::string& frame_id) {
  using visualization_msgs::Marker;
  visualization_msgs::MarkerArray markers;
  for (size_t i = 0; i < rig.cameras.size(); ++i) {
    const RigCamera& camera = rig.cameras[i];
    const auto rgb = rgbOf(i);
    Marker marker;
    marker.header.frame_id = frame_id;
    marker.id = static_cast<int>(i);
    marker.action = camera.vehicle_from_camera ? Marker::ADD : Marker::DELETE;
    marker.pose.orientation.w = 1.0;
    marker.color.r = static_cast<float>(rgb[0]) / 255.0F;
    marker.color.g = static_cast<float>(rgb[1]) / 255.0F;
    marker.color.b = static_cast<float>(rgb[2]) / 255.0F;
    marker.color.a = 1.0F;
    Marker name = marker;
    marker.ns = "cameras";
    marker.type = Marker::LINE_LIST;
    marker.scale.x = 0.03;
    name.ns = "names";
    name.type = Marker::TEXT_VIEW_FACING;
    name.scale.z = kLetter_m;
    if (camera.vehicle_from_camera) {
      const RigidTransform map_from_camera = map_from_vehicle * *camera.vehicle_from_camera;
      marker.pose = toPoseMessage(map_from_camera);
      const Eigen::Vector3d corners[] = {
          {-0.3, -0.2, kPyramid_m}, {0.3, -0.2, kPyramid_m}, {0.3, 0.2, kPyramid_m}, {-0.3, 0.2, kPyramid_m}};
      for (size_t k = 0; k < 4; ++k) {
        for (const Eigen::Vector3d& end :
             {Eigen::Vector3d(Eigen::Vector3d::Zero()), corners[k], corners[k], corners[(k + 1) % 4]}) {
          marker.points.push_back(toPoint(end));
        }
      }
      const vcharge_msgs::CameraUncertainty& known = status.cameras[i];
      const double sigma_m = std::max(known.x_m, known.y_m);
      name.text =
          camera.name + (std::isfinite(sigma_m) ? " \u00b1 " + toText(100.0 * sigma_m, 1) + " cm" : "");
      name.pose = toPoseMessage(RigidTransform(
          Eigen::Quaterniond::Identity(),
          map_from_camera * Eigen::Vector3d(0.0, 0.0, 2.0 * kPyramid_m) + Eigen::Vector3d(0.0, 0.0, 0.5)));
    }
    markers.markers.push_back(marker);
    markers.markers.push_back(name);
  }
  return markers;
}

}  // namespace vcharge
