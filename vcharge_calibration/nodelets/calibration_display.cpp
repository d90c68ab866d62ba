#include "calibration_display.h"

#include <memory>

#include "calibration_messages.h"
#include "initialization/camera_landmarks.h"
#include "vcharge_reconstruction/live_view.h"
#include "vcharge_ros/sparse_map_conversions.h"

namespace vcharge {
namespace {

constexpr const char* kFrame = "map";
constexpr int kShownKeyframes = 20;  // keyframes shown while the drive goes on

}  // namespace

CalibrationDisplay::CalibrationDisplay(ros::NodeHandle* node, const RigCalibratorOptions& options)
    : triangulation_(options.firstTriangulation()),
      status_(node->advertise<vcharge_msgs::CalibrationStatus>("/calibration/status", 10, true)),
      trajectory_(node->advertise<nav_msgs::Path>("/calibration/trajectory", 1, true)),
      landmarks_(node->advertise<sensor_msgs::PointCloud2>("/calibration/landmarks", 1, true)),
      cameras_(node->advertise<visualization_msgs::MarkerArray>("/calibration/cameras", 1, true)) {}

void CalibrationDisplay::tell(const RigCalibrationSession::Status& status) {
  vcharge_msgs::CalibrationStatus message = toStatusMessage(status);
  message.header.stamp = ros::Time::now();
  status_.publish(message);
}

void CalibrationDisplay::showDrive(const RigCalibrationSession::Status& status,
                                   const ReconstructionState& state, const CameraRig& initial_rig) {
  landmarks_.publish(
      toCloud(recentLandmarksByCamera(state, initial_rig, triangulation_, kShownKeyframes), kFrame));
  trajectory_.publish(makePath(keyframePath(state), kFrame));
  cameras_.publish(toCameraMarkers(initial_rig, state.data.keyframes.back().map_from_vehicle,
                                   toStatusMessage(status), kFrame));
}

void CalibrationDisplay::showResult(RigCalibrationSession::Status status, const FinishedCalibration& work) {
  status.phase = RigCalibrationSession::Phase::kCalibrated;
  status.result = std::make_shared<const RigCalibration>(work.result);
  landmarks_.publish(toCloud(landmarksByCamera(work.state.data), kFrame));
  trajectory_.publish(makePath(keyframePath(work.state), kFrame));
  cameras_.publish(toCameraMarkers(*work.result.rig, work.state.data.keyframes.back().map_from_vehicle,
                                   toStatusMessage(status), kFrame));
}

}  // namespace vcharge
