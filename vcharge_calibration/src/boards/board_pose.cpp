#include "boards/board_pose.h"

#include <cmath>

#include <Eigen/SVD>

#include "vcharge_core/motion/cross_matrix.h"

namespace vcharge {

std::optional<RigidTransform> boardPoseFromRays(const std::vector<BoardRay>& rays) {
  if (rays.size() < 4) {
    return std::nullopt;
  }
  // Centring and scaling keep the linear system well conditioned.
  Eigen::Vector2d mean = Eigen::Vector2d::Zero();
  for (const BoardRay& entry : rays) {
    mean += entry.point_m / static_cast<double>(rays.size());
  }
  double scale = 0.0;
  for (const BoardRay& entry : rays) {
    scale += (entry.point_m - mean).norm() / static_cast<double>(rays.size());
  }
  if (!(scale > 0.0)) {
    return std::nullopt;
  }
  // ray x (H [x y 1]) = 0. All three rows are used, so that the weight does not depend on the ray's
  // direction.
  Eigen::Matrix<double, 9, 9> normal = Eigen::Matrix<double, 9, 9>::Zero();
  for (const BoardRay& entry : rays) {
    const Eigen::Vector2d p = (entry.point_m - mean) / scale;
    const Eigen::Matrix3d cross = crossMatrix(entry.ray);
    Eigen::Matrix<double, 3, 9> rows;
    rows << p.x() * cross, p.y() * cross, cross;
    normal += rows.transpose() * rows;
  }
  const Eigen::JacobiSVD<Eigen::Matrix<double, 9, 9>> svd(normal, Eigen::ComputeFullV);
  if (svd.singularValues()[7] < 1e-14 * svd.singularValues()[0]) {
    return std::nullopt;
  }
  const Eigen::Matrix<double, 9, 1> h = svd.matrixV().col(8);
  Eigen::Matrix3d homography = Eigen::Map<const Eigen::Matrix3d>(h.data());
  // The points must lie in the direction of their rays, not opposite.
  double forward = 0.0;
  for (const BoardRay& entry : rays) {
    const Eigen::Vector2d p = (entry.point_m - mean) / scale;
    forward += entry.ray.dot(homography * Eigen::Vector3d(p.x(), p.y(), 1.0)) > 0.0 ? 1.0 : -1.0;
  }
  if (forward < 0.0) {
    homography = -homography;
  }
  const double length = std::sqrt(homography.col(0).norm() * homography.col(1).norm());
  if (!(length > 1e-12)) {
    return std::nullopt;
  }
  homography /= length;
  Eigen::Matrix3d axes;
  axes << homography.col(0), homography.col(1), homography.col(0).cross(homography.col(1));
  const Eigen::JacobiSVD<Eigen::Matrix3d> polar(axes, Eigen::ComputeFullU | Eigen::ComputeFullV);
  Eigen::Matrix3d rotation = polar.matrixU() * polar.matrixV().transpose();
  if (rotation.determinant() < 0.0 || !rotation.allFinite()) {
    return std::nullopt;
  }
  // Reverts the centring: the origin of the board is at -mean in the scaled frame.
  const Eigen::Vector3d translation =
      scale * homography.col(2) - rotation * Eigen::Vector3d(mean.x(), mean.y(), 0.0);
  return RigidTransform(Eigen::Quaterniond(rotation), translation);
}

std::optional<RigidTransform> boardPose(const CalibrationBoard& board,
                                        const std::vector<BoardCorner>& corners, const CameraModel& model) {
  std::vector<BoardRay> rays;
  for (const BoardCorner& corner : corners) {
    Eigen::Vector3d ray;
    if (model.unproject(corner.pixel, &ray)) {
      rays.push_back({board.corner(corner.index).head<2>(), ray});
    }
  }
  return boardPoseFromRays(rays);
}

}  // namespace vcharge
