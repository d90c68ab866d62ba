#include "vcharge_ros/camera_info.h"

#include <limits>
#include <stdexcept>

#include <sensor_msgs/distortion_models.h>

namespace vcharge {
namespace {

void setMatrices(double fx, double fy, double cx, double cy, sensor_msgs::CameraInfo* info) {
  info->K = {fx, 0.0, cx, 0.0, fy, cy, 0.0, 0.0, 1.0};
  info->R = {1.0, 0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 1.0};
  info->P = {fx, 0.0, cx, 0.0, 0.0, fy, cy, 0.0, 0.0, 0.0, 1.0, 0.0};
}

void setEquidistant(const KannalaBrandtCamera& camera, sensor_msgs::CameraInfo* info) {
  const KannalaBrandtCamera::Parameters& p = camera.parameters();
  info->distortion_model = sensor_msgs::distortion_models::EQUIDISTANT;
  info->D = {p[4], p[5], p[6], p[7]};
  setMatrices(p[0], p[1], p[2], p[3], info);
}

}  // namespace

sensor_msgs::CameraInfo makeCameraInfo(const CameraModel& model, cv::Size image_size_px,
                                       double field_of_view_rad, const std::string& frame_id,
                                       CameraInfoResidual* residual) {
  sensor_msgs::CameraInfo info;
  info.header.frame_id = frame_id;
  info.width = static_cast<uint32_t>(image_size_px.width);
  info.height = static_cast<uint32_t>(image_size_px.height);
  CameraInfoResidual left_over;
  if (const auto* pinhole = std::get_if<PinholeCamera>(&model.variant())) {
    const PinholeCamera::Parameters p = pinhole->parameters();
    info.distortion_model = sensor_msgs::distortion_models::PLUMB_BOB;
    info.D = {p[4], p[5], p[6], p[7], 0.0};
    setMatrices(p[0], p[1], p[2], p[3], &info);
  } else if (const auto* kannala_brandt = std::get_if<KannalaBrandtCamera>(&model.variant())) {
    setEquidistant(*kannala_brandt, &info);
  } else {
    try {
      const EquidistantFit fit = fitEquidistant(model, image_size_px, field_of_view_rad);
      setEquidistant(fit.camera, &info);
      left_over = {fit.rms_px, fit.max_px};
    } catch (const std::invalid_argument&) {
      // K stays zero, which in ROS means an uncalibrated camera.
      left_over = {std::numeric_limits<double>::infinity(), std::numeric_limits<double>::infinity()};
    }
  }
  if (residual != nullptr) {
    *residual = left_over;
  }
  return info;
}

sensor_msgs::CameraInfo makeCameraInfo(const RigCamera& camera, CameraInfoResidual* residual) {
  return makeCameraInfo(camera.model, camera.image_size_px, camera.field_of_view_rad, camera.frame_id,
                        residual);
}

}  // namespace vcharge
