#include "surround_view/ground_projection.h"

#include <array>
#include <cmath>
#include <limits>
#include <optional>

#include <Eigen/LU>
#include <opencv2/imgproc.hpp>

#include "kernels/parallel_rows.h"
#include "surround_view/image_pyramid.h"
#include "vcharge_core/camera/pixel_angle.h"
#include "vcharge_core/motion/cross_matrix.h"

namespace vcharge {
namespace {

constexpr double kPixelSigma_px = 0.5;
// Margins of the field of view and of masks: lenses blur what lies beyond them into the image.
constexpr double kRim_px = 6.0;
constexpr int kMaskMargin_px = 3;
constexpr double kStep_m = 0.005;               // for derivatives of the projection
constexpr double kLeastPixelsPerMetre2 = 1e-6;  // the surface is seen edge-on below

using Projection = Eigen::Matrix<double, 2, 3>;

/// One camera and its masks at all levels of a pyramid.
class ViewCamera {
 public:
  ViewCamera(const ViewGrid& grid, const CameraRig& rig, size_t camera_index)
      : grid_(grid),
        camera_(rig.cameras[camera_index]),
        camera_from_vehicle_(camera_.vehicle_from_camera->inverse()),
        covariance_(rig.covarianceWithScale(camera_index)),
        masks_(camera_.image_size_px) {
    const double pixel_rad = radiansPerPixel(camera_);
    for (int level = 0; level < ImagePyramid::kNumLevels; ++level) {
      // All four pixels of a sample must lie inside.
      min_cos_angles_[static_cast<size_t>(level)] =
          std::cos(0.5 * camera_.field_of_view_rad - (kRim_px + 1.5 * (1 << level)) * pixel_rad);
    }
    cv::Mat mask(camera_.image_size_px, CV_8UC1, cv::Scalar(255));
    if (!camera_.mask.empty()) {
      constexpr int kWidth_px = 2 * kMaskMargin_px + 1;
      cv::erode(camera_.mask != 0, mask, cv::Mat::ones(kWidth_px, kWidth_px, CV_8UC1));
    }
    masks_.set(mask);
  }

  /// Fills one pixel of the tables unless the camera does not see it.
  void see(const Eigen::Vector2d& position_m, PyramidPosition* position, float* sigma_m,
           uint8_t* angle) const {
    if (grid_.distanceToVehicle_m(position_m) == 0.0) {
      return;
    }
    const Eigen::Vector3d point(position_m.x(), position_m.y(), grid_.height_m(position_m));
    Eigen::Vector2d pixel;
    Projection pixel_by_point;
    if (!project(point, &pixel)) {
      return;
    }
    for (int axis = 0; axis < 3; ++axis) {
      Eigen::Vector2d moved;
      if (!project(point + kStep_m * Eigen::Vector3d::Unit(axis), &moved)) {
        return;
      }
      pixel_by_point.col(axis) = (moved - pixel) / kStep_m;
    }
    Eigen::Matrix<double, 3, 2> point_by_position;
    point_by_position << 1.0, 0.0, 0.0, 1.0,
        (grid_.height_m(position_m + Eigen::Vector2d(kStep_m, 0.0)) - point.z()) / kStep_m,
        (grid_.height_m(position_m + Eigen::Vector2d(0.0, kStep_m)) - point.z()) / kStep_m;
    const Eigen::Matrix2d pixel_by_position = pixel_by_point * point_by_position;
    const double area = std::abs(pixel_by_position.determinant());
    const Eigen::Vector3d in_camera = camera_from_vehicle_ * point;
    if (!(area > kLeastPixelsPerMetre2) ||
        !find(pixel, std::sqrt(area) * grid_.pixel_m(), in_camera.normalized().z(), position)) {
      return;
    }
    const Eigen::Matrix2d position_by_pixel = pixel_by_position.inverse();
    const Eigen::Matrix2d covariance =
        position_by_pixel * pixelCovariance(point, pixel_by_point) * position_by_pixel.transpose();
    *sigma_m = static_cast<float>(std::sqrt(covariance.trace()));
    const double angle_rad = std::atan2(in_camera.head<2>().norm(), in_camera.z());
    *angle = static_cast<uint8_t>(std::lround(angle_rad / M_PI * kAngleSteps));
  }

 private:
  bool project(const Eigen::Vector3d& point_in_vehicle, Eigen::Vector2d* pixel) const {
    const Eigen::Vector3d point = camera_from_vehicle_ * point_in_vehicle;
    return point.z() >= min_cos_angles_[0] * point.norm() && camera_.model.project(point, pixel);
  }

  Eigen::Matrix2d pixelCovariance(const Eigen::Vector3d& point, const Projection& pixel_by_point) const {
    Eigen::Matrix2d covariance = kPixelSigma_px * kPixelSigma_px * Eigen::Matrix2d::Identity();
    if (covariance_) {
      Eigen::Matrix<double, 3, 6> point_by_extrinsics;
      point_by_extrinsics << Eigen::Matrix3d::Identity(),
          -crossMatrix(point - camera_.vehicle_from_camera->translation());
      const Eigen::Matrix<double, 2, 6> pixel_by_extrinsics = pixel_by_point * point_by_extrinsics;
      covariance += pixel_by_extrinsics * *covariance_ * pixel_by_extrinsics.transpose();
    }
    return covariance;
  }

  /// The position in the level whose pixels are about as large as those of the view; false outside the image,
  /// the field of view and the mask.
  bool find(const Eigen::Vector2d& pixel, double source_px, double cos_angle,
            PyramidPosition* position) const {
    const int level = std::clamp(static_cast<int>(std::lround(std::log2(std::max(source_px, 1.0)))), 0,
                                 ImagePyramid::kNumLevels - 1);
    const Eigen::Vector2d in_level =
        (pixel.array() + 0.5) / (1 << level) - 0.5 + 0.5 / 256.0;  // rounds the weights
    const double column = std::floor(in_level.x()), row = std::floor(in_level.y());
    const cv::Rect& rect = masks_.rect(level);
    if (cos_angle < min_cos_angles_[static_cast<size_t>(level)] ||
        !(column >= 0.0 && row >= 0.0 && column < rect.width - 1 && row < rect.height - 1)) {
      return false;
    }
    const cv::Point corner(static_cast<int>(column), static_cast<int>(row));
    double lowest = 0.0;
    cv::minMaxLoc(masks_.level(level)(cv::Rect(corner, cv::Size(2, 2))), &lowest);
    position->offset = (rect.y + corner.y) * masks_.stride() + corner.x;
    position->right = static_cast<uint8_t>(256.0 * (in_level.x() - column));
    position->down = static_cast<uint8_t>(256.0 * (in_level.y() - row));
    return lowest == 255.0;
  }

  const ViewGrid& grid_;
  const RigCamera& camera_;
  const RigidTransform camera_from_vehicle_;
  const std::optional<Eigen::Matrix<double, 6, 6>> covariance_;
  std::array<double, ImagePyramid::kNumLevels> min_cos_angles_{};  // of rays to the optical axis
  ImagePyramid masks_;
};

}  // namespace

GroundProjection projectView(const ViewGrid& grid, const CameraRig& rig, size_t camera_index) {
  const ViewCamera camera(grid, rig, camera_index);
  const auto num_pixels = static_cast<size_t>(grid.size().area());
  GroundProjection projection;
  projection.positions.resize(num_pixels);
  projection.sigma_m.assign(num_pixels, std::numeric_limits<float>::infinity());
  projection.angles.resize(num_pixels);
  forEachRow(grid.size().height, [&](int row) {
    for (int column = 0; column < grid.size().width; ++column) {
      const size_t i = static_cast<size_t>(row) * grid.size().width + column;
      camera.see(grid.positionOf({column, row}), &projection.positions[i], &projection.sigma_m[i],
                 &projection.angles[i]);
    }
  });
  return projection;
}

}  // namespace vcharge
