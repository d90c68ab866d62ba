#pragma once

#include <Eigen/Core>

#include "vcharge_geometry/pose_graph/pose_graph.h"

namespace vcharge {

using Matrix6d = Eigen::Matrix<double, 6, 6>;
using Vector6d = Eigen::Matrix<double, 6, 1>;

/// A relative pose and its covariance over [dt (m), dphi (rad)] in the second frame: a small motion after the
/// pose. In planar graphs rows and columns 2, 3 and 4 are zero.
struct RelativePose {
  RigidTransform first_from_second;
  Matrix6d covariance = Matrix6d::Zero();
};

/// What an edge measures. Directions without information have a deviation of 1000 m or rad.
RelativePose measuredBy(const PoseGraphEdge& edge, bool planar);

RelativePose operator*(const RelativePose& first, const RelativePose& second);
RelativePose inverseOf(const RelativePose& pose);

/// Error between two independent estimates of one relative pose, and the covariance of that error.
struct Disagreement {
  Disagreement(const RelativePose& predicted, const RelativePose& measured, bool planar);

  double chiSquared() const;
  /// Logarithm of the likelihood ratio of "both are of one pose" over "their error has the covariance
  /// `spread` besides": high if they agree, and if agreement by chance would be unlikely. Real errors have
  /// longer tails than normal ones: one in fifty has ten times the covariance.
  double logEvidence(const Matrix6d& spread) const;

 private:
  Eigen::VectorXd error_;
  Eigen::MatrixXd covariance_;
  bool planar_;
};

}  // namespace vcharge
