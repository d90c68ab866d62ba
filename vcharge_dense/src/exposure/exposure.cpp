#include "vcharge_dense/exposure.h"

#include <vector>

#include <Eigen/QR>

namespace vcharge {
namespace {

constexpr int kStep_px = 8;  // distance of the pixels that times are fitted to

}  // namespace

ExposureTimes ExposureTimes::of(const RigCamera& camera, const WorkingCamera& working) {
  ExposureTimes times;
  times.lines_are_columns = camera.timing.readout_direction == ReadoutDirection::kLeft ||
                            camera.timing.readout_direction == ReadoutDirection::kRight;
  times.coefficients_s[0] = camera.timing.clock_offset_s;
  if (camera.timing.readout_s == 0.0) {
    return times;
  }
  std::vector<Eigen::Vector4d> terms;
  std::vector<double> exposed_s;
  for (int y = 0; y < working.size().height; y += kStep_px) {
    for (int x = 0; x < working.size().width; x += kStep_px) {
      const cv::Vec2f& sensor_px = working.sensorPixels().at<cv::Vec2f>(y, x);
      if (sensor_px[0] < 0.0F) {
        continue;
      }
      const Eigen::Vector2d point = imagePoint(working.model(), Eigen::Vector2d(x, y));
      const double across = point[times.lines_are_columns ? 0 : 1], squared = point.squaredNorm();
      terms.emplace_back(1.0, across, across * squared, across * squared * squared);
      exposed_s.push_back(camera.exposedAt({sensor_px[0], sensor_px[1]}));
    }
  }
  if (terms.size() < 4) {
    return times;
  }
  const auto rows = static_cast<Eigen::Index>(terms.size());
  const Eigen::Map<const Eigen::Matrix<double, Eigen::Dynamic, 4, Eigen::RowMajor>> matrix(terms[0].data(),
                                                                                           rows, 4);
  times.coefficients_s =
      matrix.colPivHouseholderQr().solve(Eigen::Map<const Eigen::VectorXd>(exposed_s.data(), rows));
  return times;
}

Exposure Exposure::of(const ExposureTimes& times, const RigidTransform& vehicle_from_camera,
                      const ImageMotion& motion) {
  const Eigen::Quaterniond camera_from_vehicle = vehicle_from_camera.rotation().conjugate();
  Exposure exposure{times, camera_from_vehicle * motion.rates.velocityOf(vehicle_from_camera.translation()),
                    camera_from_vehicle * Eigen::Vector3d(0.0, 0.0, motion.rates.yaw_rate_rad_per_s)};
  exposure.times.coefficients_s[0] += motion.offset_s;
  return exposure;
}

}  // namespace vcharge
