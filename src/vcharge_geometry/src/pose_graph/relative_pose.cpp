#include "pose_graph/relative_pose.h"

#include <algorithm>
#include <array>
#include <cmath>

#include <Eigen/Cholesky>
#include <Eigen/Eigenvalues>

#include "vcharge_core/motion/cross_matrix.h"

namespace vcharge {
namespace {

constexpr std::array<int, 3> kPlanarRows{0, 1, 5};

/// Motion in the target's frame of a motion in the source's.
Matrix6d adjointOf(const RigidTransform& target_from_source) {
  Matrix6d adjoint = Matrix6d::Zero();
  const Eigen::Matrix3d turn = target_from_source.rotationMatrix();
  adjoint.topLeftCorner<3, 3>() = turn;
  adjoint.topRightCorner<3, 3>() = crossMatrix(target_from_source.translation()) * turn;
  adjoint.bottomRightCorner<3, 3>() = turn;
  return adjoint;
}

Eigen::MatrixXd usedPart(const Matrix6d& matrix, bool planar) {
  if (!planar) {
    return matrix;
  }
  Eigen::Matrix3d used;
  for (int i = 0; i < 3; ++i) {
    for (int j = 0; j < 3; ++j) {
      used(i, j) = matrix(kPlanarRows[i], kPlanarRows[j]);
    }
  }
  return used;
}

double logDeterminant(const Eigen::LLT<Eigen::MatrixXd>& factor) {
  return 2.0 * factor.matrixLLT().diagonal().array().log().sum();
}

}  // namespace

RelativePose measuredBy(const PoseGraphEdge& edge, bool planar) {
  constexpr double kMinInformation = 1e-6;
  const Eigen::MatrixXd information = usedPart(edge.information, planar);
  const Eigen::SelfAdjointEigenSolver<Eigen::MatrixXd> eigen(information);
  const Eigen::MatrixXd covariance =
      eigen.eigenvectors() * eigen.eigenvalues().cwiseMax(kMinInformation).cwiseInverse().asDiagonal() *
      eigen.eigenvectors().transpose();
  RelativePose pose;
  pose.first_from_second = edge.first_from_second;
  if (planar) {
    for (int i = 0; i < 3; ++i) {
      for (int j = 0; j < 3; ++j) {
        pose.covariance(kPlanarRows[i], kPlanarRows[j]) = covariance(i, j);
      }
    }
    return pose;
  }
  // The vector part of a quaternion is half an angle.
  Vector6d scale;
  scale << 1.0, 1.0, 1.0, 2.0, 2.0, 2.0;
  pose.covariance = scale.asDiagonal() * covariance * scale.asDiagonal();
  return pose;
}

RelativePose operator*(const RelativePose& first, const RelativePose& second) {
  const Matrix6d adjoint = adjointOf(second.first_from_second.inverse());
  return {first.first_from_second * second.first_from_second,
          adjoint * first.covariance * adjoint.transpose() + second.covariance};
}

RelativePose inverseOf(const RelativePose& pose) {
  const Matrix6d adjoint = adjointOf(pose.first_from_second);
  return {pose.first_from_second.inverse(), adjoint * pose.covariance * adjoint.transpose()};
}

Disagreement::Disagreement(const RelativePose& predicted, const RelativePose& measured, bool planar)
    : planar_(planar) {
  const RigidTransform difference = measured.first_from_second.inverse() * predicted.first_from_second;
  if (planar) {
    error_ = Eigen::Vector3d(difference.translation().x(), difference.translation().y(),
                             yawOfRotation(difference.rotation()));
  } else {
    error_.resize(6);
    error_ << difference.translation(), vectorFromRotation(difference.rotation());
  }
  covariance_ = usedPart(predicted.covariance + measured.covariance, planar);
}

double Disagreement::chiSquared() const {
  return error_.dot(covariance_.llt().solve(error_));
}

double Disagreement::logEvidence(const Matrix6d& spread) const {
  constexpr double kTailVariances = 10.0;
  constexpr double kTailFraction = 0.02;
  const auto logLikelihood = [this](const Eigen::MatrixXd& covariance) {
    const Eigen::LLT<Eigen::MatrixXd> factor(covariance);
    return -0.5 * (logDeterminant(factor) + error_.dot(factor.solve(error_)));
  };
  const double same = std::max(logLikelihood(covariance_),
                               std::log(kTailFraction) + logLikelihood(kTailVariances * covariance_));
  // The density of other poses is taken as that at their mean everywhere, so that no error speaks for itself.
  return same + 0.5 * logDeterminant((covariance_ + usedPart(spread, planar_)).llt());
}

}  // namespace vcharge
