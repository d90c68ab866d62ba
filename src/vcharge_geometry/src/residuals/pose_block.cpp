#include "vcharge_geometry/residuals/pose_block.h"

#include <ceres/manifold.h>

#include "residuals/pose_jacobians.h"

namespace vcharge {
namespace {

class PoseManifold : public ceres::Manifold {
 public:
  int AmbientSize() const override { return 7; }
  int TangentSize() const override { return 6; }

  bool Plus(const double* x, const double* delta, double* x_plus_delta) const override {
    const Eigen::Map<const Eigen::Matrix<double, 6, 1>> step(delta);
    const Eigen::Map<const Eigen::Quaterniond> rotation(x + 3);
    Eigen::Map<Eigen::Vector3d>(x_plus_delta, 3) = Eigen::Map<const Eigen::Vector3d>(x) + step.head<3>();
    Eigen::Map<Eigen::Quaterniond> moved(x_plus_delta + 3);
    moved = (rotationFromVector(step.tail<3>()) * rotation).normalized();
    return true;
  }

  bool PlusJacobian(const double* x, double* jacobian) const override {
    Eigen::Map<Eigen::Matrix<double, 7, 6, Eigen::RowMajor>> matrix(jacobian);
    matrix.setZero();
    matrix.topLeftCorner<3, 3>().setIdentity();
    matrix.bottomRightCorner<4, 3>() = quaternionByTurn(x + 3);
    return true;
  }

  bool Minus(const double* y, const double* x, double* difference) const override {
    const Eigen::Map<const Eigen::Quaterniond> to(y + 3);
    const Eigen::Map<const Eigen::Quaterniond> from(x + 3);
    Eigen::Map<Eigen::Matrix<double, 6, 1>> step(difference);
    step.head<3>() = Eigen::Map<const Eigen::Vector3d>(y) - Eigen::Map<const Eigen::Vector3d>(x);
    step.tail<3>() = vectorFromRotation(to * from.conjugate());
    return true;
  }

  bool MinusJacobian(const double* x, double* jacobian) const override {
    Eigen::Map<Eigen::Matrix<double, 6, 7, Eigen::RowMajor>> matrix(jacobian);
    matrix.setZero();
    matrix.topLeftCorner<3, 3>().setIdentity();
    matrix.bottomRightCorner<3, 4>() = turnByQuaternion(x + 3);
    return true;
  }
};

}  // namespace

PoseBlock toPoseBlock(const RigidTransform& target_from_source) {
  const Eigen::Vector3d& t = target_from_source.translation();
  const Eigen::Quaterniond& q = target_from_source.rotation();
  return {t.x(), t.y(), t.z(), q.x(), q.y(), q.z(), q.w()};
}

RigidTransform fromPoseBlock(const double* block) {
  return RigidTransform(Eigen::Quaterniond(block[6], block[3], block[4], block[5]),
                        Eigen::Vector3d(block[0], block[1], block[2]));
}

std::unique_ptr<ceres::Manifold> makePoseManifold() {
  return std::make_unique<PoseManifold>();
}

}  // namespace vcharge
