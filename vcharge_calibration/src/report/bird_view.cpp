#include "report/bird_view.h"

#include <algorithm>
#include <cmath>
#include <utility>

#include <Eigen/Eigenvalues>
#include <opencv2/imgproc.hpp>

#include "vcharge_core/base/error.h"
#include "vcharge_core/motion/cross_matrix.h"
#include "vcharge_reconstruction/keyframe_images.h"

namespace vcharge {
namespace {

using Matrix6d = Eigen::Matrix<double, 6, 6>;
const cv::Vec3b kSeamColour(40, 190, 255);  // BGR
constexpr double kSeamOpacity = 0.5;
constexpr double kMinSeamAngle_rad = 0.3;  // minimum angle between cameras with a seam

Eigen::Vector3d axisOf(const RigCamera& camera) {
  return camera.vehicle_from_camera->rotation() * Eigen::Vector3d::UnitZ();
}

/// Projections of points in the vehicle's frame to a camera.
struct Projection {
  Eigen::Matrix2Xd pixels;
  std::vector<uint8_t> valid;
  Eigen::RowVectorXd cosines;  ///< cosines of the angles to the camera's axis
};

Projection projectTo(const RigCamera& camera, const Eigen::Matrix3Xd& points) {
  Projection projection;
  const RigidTransform camera_from_vehicle = camera.vehicle_from_camera->inverse();
  const Eigen::Matrix3Xd in_camera =
      (camera_from_vehicle.rotationMatrix() * points).colwise() + camera_from_vehicle.translation();
  camera.model.project(in_camera, &projection.pixels, &projection.valid);
  projection.cosines = in_camera.row(2).cwiseQuotient(in_camera.colwise().norm());
  const double least_cosine = std::cos(0.5 * camera.field_of_view_rad);
  for (Eigen::Index i = 0; i < points.cols(); ++i) {
    const cv::Point at(static_cast<int>(std::lround(projection.pixels(0, i))),
                       static_cast<int>(std::lround(projection.pixels(1, i))));
    const bool is_seen = projection.valid[static_cast<size_t>(i)] != 0 &&
                         projection.cosines[i] > least_cosine &&
                         cv::Rect(cv::Point(), camera.image_size_px).contains(at) &&
                         (camera.mask.empty() || camera.mask.at<uint8_t>(at) != 0);
    projection.valid[static_cast<size_t>(i)] = is_seen ? 1 : 0;
  }
  return projection;
}

/// The gray level at a pixel of the full image, read from a copy that may be smaller.
uint8_t sample(const cv::Mat& image, const RigCamera& camera, const Eigen::Vector2d& position_px) {
  const double scale = static_cast<double>(image.cols) / camera.image_size_px.width;
  const double x = std::clamp(toSmallImage(position_px.x(), scale), 0.0, image.cols - 1.001);
  const double y = std::clamp(toSmallImage(position_px.y(), scale), 0.0, image.rows - 1.001);
  const int column = static_cast<int>(x), row = static_cast<int>(y);
  const double u = x - column, v = y - row;
  const auto* above = image.ptr<uint8_t>(row) + column;
  const auto* below = image.ptr<uint8_t>(row + 1) + column;
  return cv::saturate_cast<uint8_t>((1.0 - v) * ((1.0 - u) * above[0] + u * above[1]) +
                                    v * ((1.0 - u) * below[0] + u * below[1]));
}

void drawSeams(const cv::Mat& owner, cv::Mat* view) {
  for (int row = 0; row + 1 < owner.rows; ++row) {
    for (int column = 0; column + 1 < owner.cols; ++column) {
      const int here = owner.at<int8_t>(row, column);
      const auto isSeam = [here](int there) { return here >= 0 && there >= 0 && here != there; };
      if (isSeam(owner.at<int8_t>(row, column + 1)) || isSeam(owner.at<int8_t>(row + 1, column))) {
        auto& pixel = view->at<cv::Vec3b>(row, column);
        pixel = pixel * (1.0 - kSeamOpacity) + kSeamColour * kSeamOpacity;
      }
    }
  }
}

/// Intersection of a ray of a camera with the ground.
Eigen::Vector2d meetGround(const RigidTransform& vehicle_from_camera, const Eigen::Vector3d& ray_in_camera) {
  const Eigen::Vector3d ray = vehicle_from_camera.rotation() * ray_in_camera;
  const Eigen::Vector3d& from = vehicle_from_camera.translation();
  return (from - from.z() / ray.z() * ray).head<2>();
}

Eigen::Vector3d onGround(const Eigen::Vector2d& ground_m) {
  return {ground_m.x(), ground_m.y(), 0.0};
}

/// Pairs of cameras with neighbouring viewing directions.
std::vector<std::pair<size_t, size_t>> neighbours(const CameraRig& rig) {
  std::vector<std::pair<double, size_t>> by_yaw;
  for (size_t i = 0; i < rig.cameras.size(); ++i) {
    const Eigen::Vector3d axis = axisOf(rig.cameras[i]);
    by_yaw.emplace_back(std::atan2(axis.y(), axis.x()), i);
  }
  std::sort(by_yaw.begin(), by_yaw.end());
  std::vector<std::pair<size_t, size_t>> pairs;
  for (size_t i = 0; i < by_yaw.size() && by_yaw.size() > 1; ++i) {
    if (i + 1 < by_yaw.size() || by_yaw.size() > 2) {
      pairs.emplace_back(by_yaw[i].second, by_yaw[(i + 1) % by_yaw.size()].second);
    }
  }
  return pairs;
}

}  // namespace

cv::Mat makeBirdView(const CameraRig& rig, const std::vector<cv::Mat>& images, const BirdViewArea& area) {
  check(rig.hasExtrinsics() && images.size() == rig.cameras.size(),
        "makeBirdView: expected extrinsics and an image per camera");
  const int rows = static_cast<int>(std::lround((area.front_m + area.rear_m) / area.metres_per_px));
  const int columns = static_cast<int>(std::lround(2.0 * area.side_m / area.metres_per_px));
  Eigen::Matrix3Xd points(3, static_cast<Eigen::Index>(rows) * columns);
  for (Eigen::Index i = 0; i < points.cols(); ++i) {
    points.col(i) << area.front_m - area.metres_per_px * (static_cast<double>(i / columns) + 0.5),
        area.side_m - area.metres_per_px * (static_cast<double>(i % columns) + 0.5), 0.0;
  }
  cv::Mat view(rows, columns, CV_8UC3, cv::Scalar::all(0)), owner(rows, columns, CV_8SC1, cv::Scalar(-1));
  Eigen::RowVectorXd best = Eigen::RowVectorXd::Constant(points.cols(), -2.0);
  for (size_t camera = 0; camera < rig.cameras.size(); ++camera) {
    if (images[camera].empty()) {
      continue;
    }
    const Projection projection = projectTo(rig.cameras[camera], points);
    for (Eigen::Index i = 0; i < points.cols(); ++i) {
      if (projection.valid[static_cast<size_t>(i)] != 0 && projection.cosines[i] > best[i]) {
        best[i] = projection.cosines[i];
        const int row = static_cast<int>(i / columns), column = static_cast<int>(i % columns);
        view.at<cv::Vec3b>(row, column) =
            cv::Vec3b::all(sample(images[camera], rig.cameras[camera], projection.pixels.col(i)));
        owner.at<int8_t>(row, column) = static_cast<int8_t>(camera);
      }
    }
  }
  drawSeams(owner, &view);
  return view;
}

Eigen::Matrix2d groundCovariance(const RigidTransform& vehicle_from_camera, const Matrix6d& covariance,
                                 const Eigen::Vector2d& ground_m) {
  const Eigen::Vector3d ray = onGround(ground_m) - vehicle_from_camera.translation();
  check(ray.z() < 0.0, "groundCovariance: expected a camera above the ground");
  // The point on the ray moves by dt + dphi x ray, then along the ray back to the ground.
  Eigen::Matrix<double, 3, 6> moved;
  moved << Eigen::Matrix3d::Identity(), crossMatrix(-ray);
  const Eigen::Matrix<double, 2, 6> on_ground =
      moved.topRows<2>() - ray.head<2>() / ray.z() * moved.bottomRows<1>();
  return on_ground * covariance * on_ground.transpose();
}

std::vector<SeamPoint> seamPoints(const CameraRig& rig, const CameraRig* before,
                                  const std::vector<double>& distances_m) {
  check(rig.hasExtrinsics(), "seamPoints: expected extrinsics");
  std::vector<SeamPoint> points;
  for (const auto& [first, second] : neighbours(rig)) {
    const RigCamera& a = rig.cameras[first];
    const RigCamera& b = rig.cameras[second];
    const Eigen::Vector2d along_a = axisOf(a).head<2>().normalized(),
                          along_b = axisOf(b).head<2>().normalized();
    if (along_a.dot(along_b) > std::cos(kMinSeamAngle_rad) || (along_a + along_b).norm() < 1e-3) {
      continue;
    }
    const Eigen::Vector2d middle =
        0.5 * (a.vehicle_from_camera->translation() + b.vehicle_from_camera->translation()).head<2>();
    for (const double distance_m : distances_m) {
      SeamPoint point;
      point.first = first;
      point.second = second;
      point.distance_m = distance_m;
      point.ground_m = middle + distance_m * (along_a + along_b).normalized();
      const Eigen::Vector3d ground = onGround(point.ground_m);
      point.is_seen = projectTo(a, ground).valid[0] != 0 && projectTo(b, ground).valid[0] != 0;
      if (a.covariance && b.covariance) {
        const Eigen::Matrix2d sum = groundCovariance(*a.vehicle_from_camera, *a.covariance, point.ground_m) +
                                    groundCovariance(*b.vehicle_from_camera, *b.covariance, point.ground_m);
        point.sigma_m = std::sqrt(Eigen::SelfAdjointEigenSolver<Eigen::Matrix2d>(sum).eigenvalues()[1]);
      }
      if (before != nullptr) {
        const auto shown = [&](size_t camera) {
          return meetGround(*before->cameras[camera].vehicle_from_camera,
                            rig.cameras[camera].vehicle_from_camera->inverse() * ground);
        };
        point.before_m = (shown(first) - shown(second)).norm();
      }
      points.push_back(point);
    }
  }
  return points;
}

}  // namespace vcharge
