#pragma once

#include <Eigen/Core>

#include "vcharge_reconstruction/bundle_problem.h"

namespace vcharge {

struct BundleSolution {
  bool converged = false;
  int num_iterations = 0;
  double cost = 0.0;  ///< half of the sum of (robust) squares
};

/// Levenberg-Marquardt on the reduced system of the poses (Schur complement of the points), factorized by
/// CHOLMOD. Each iteration recomputes the weights of the robust loss. Ends after `max_iterations` or
/// when the relative decrease of the cost is at most `cost_tolerance`. Data parallel, with sums in a fixed
/// order: the same result on any number of threads. std::logic_error where the problem's lists do not fit
/// together.
BundleSolution solveBundle(int max_iterations, double cost_tolerance, BundleProblem* problem);

/// Uncertainty of the odometer's factors and the extrinsics of an adjusted problem; rows and columns
/// [distance, turn, then dt, dphi and, where intrinsics are unknown, the ImageDeviation, and where timing is,
/// the TimingDeviation of each camera].
struct BundleCovariance {
  bool is_valid = false;  ///< false if an unknown is not observable
  /// Marginal covariance (Schur complement) for independent errors with the given standard deviations.
  Eigen::MatrixXd covariance;
  /// Contribution of each pose's terms (its observations and its odometer factor) to the unknowns, one column
  /// per pose. Sums over parts of a drive show how the unknowns would differ without that part: a jackknife.
  Eigen::MatrixXd influence;
};
BundleCovariance bundleCovariance(const BundleProblem& problem);

}  // namespace vcharge
