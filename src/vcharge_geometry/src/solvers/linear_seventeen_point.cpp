#include "vcharge_geometry/solvers/linear_seventeen_point.h"

#include <array>
#include <cmath>

#include <Eigen/QR>
#include <Eigen/SVD>

namespace vcharge {
namespace {

/// Row-major entries of a b^T.
Eigen::Matrix<double, 1, 9> outerProduct(const Eigen::Vector3d& a, const Eigen::Vector3d& b) {
  Eigen::Matrix<double, 1, 9> row;
  row << a.x() * b.transpose(), a.y() * b.transpose(), a.z() * b.transpose();
  return row;
}

/// Least-squares translation for a rotation, and its mean squared residual; false where it is not unique.
bool translationForRotation(const std::vector<LineMatch>& matches, const Eigen::Matrix3d& rotation,
                            Eigen::Vector3d* translation_m, double* residual) {
  Eigen::Matrix<double, Eigen::Dynamic, 3> rows(static_cast<Eigen::Index>(matches.size()), 3);
  Eigen::VectorXd constants(rows.rows());
  for (Eigen::Index i = 0; i < rows.rows(); ++i) {
    const LineMatch& match = matches[static_cast<size_t>(i)];
    const Eigen::Vector3d current = rotation * match.current.direction;
    rows.row(i) = current.cross(match.previous.direction);
    constants[i] = match.previous.direction.dot(rotation * match.current.moment_m) +
                   match.previous.moment_m.dot(current);
  }
  const Eigen::ColPivHouseholderQR<Eigen::Matrix<double, Eigen::Dynamic, 3>> decomposition(rows);
  if (decomposition.rank() < 3) {
    return false;
  }
  *translation_m = decomposition.solve(-constants);
  *residual = (rows * *translation_m + constants).squaredNorm();
  return true;
}

}  // namespace

SolverStatus solveLinearSeventeenPoint(const std::vector<LineMatch>& matches,
                                       RigidTransform* previous_from_current) {
  if (matches.size() < 17) {
    return SolverStatus::kDegenerate;
  }
  const auto num_rows = static_cast<Eigen::Index>(matches.size());
  Eigen::Matrix<double, Eigen::Dynamic, 9> essential_part(num_rows, 9);
  Eigen::Matrix<double, Eigen::Dynamic, 9> rotation_part(num_rows, 9);
  for (Eigen::Index i = 0; i < num_rows; ++i) {
    const LineMatch& match = matches[static_cast<size_t>(i)];
    essential_part.row(i) = outerProduct(match.previous.direction, match.current.direction);
    rotation_part.row(i) = outerProduct(match.previous.direction, match.current.moment_m) +
                           outerProduct(match.previous.moment_m, match.current.direction);
  }
  if (!essential_part.allFinite() || !rotation_part.allFinite()) {
    return SolverStatus::kNotFinite;
  }
  Eigen::ColPivHouseholderQR<Eigen::Matrix<double, Eigen::Dynamic, 9>> projection;
  projection.setThreshold(1e-10);
  projection.compute(rotation_part);
  const Eigen::Index rank = projection.rank();
  const Eigen::MatrixXd rotated = projection.householderQ().transpose() * essential_part;
  const Eigen::MatrixXd remaining = rotated.bottomRows(num_rows - rank);
  const Eigen::JacobiSVD<Eigen::MatrixXd> svd(remaining, Eigen::ComputeFullV);
  // Eight independent rows determine E up to its scale.
  if (svd.singularValues().size() < 8 || svd.singularValues()[7] <= 1e-10 * svd.singularValues()[0]) {
    return SolverStatus::kDegenerate;
  }
  const Eigen::Matrix<double, 9, 1> entries = svd.matrixV().col(8);
  const Eigen::Matrix3d essential =
      Eigen::Map<const Eigen::Matrix<double, 3, 3, Eigen::RowMajor>>(entries.data());
  const Eigen::JacobiSVD<Eigen::Matrix3d> factors(essential, Eigen::ComputeFullU | Eigen::ComputeFullV);
  Eigen::Matrix3d turn;
  turn << 0.0, -1.0, 0.0, 1.0, 0.0, 0.0, 0.0, 0.0, 1.0;
  double smallest_residual = INFINITY;
  for (const Eigen::Matrix3d& middle : std::array<Eigen::Matrix3d, 2>{turn, turn.transpose()}) {
    Eigen::Matrix3d rotation = factors.matrixU() * middle * factors.matrixV().transpose();
    if (rotation.determinant() < 0.0) {
      rotation = -rotation;
    }
    Eigen::Vector3d translation_m;
    double residual = 0.0;
    if (translationForRotation(matches, rotation, &translation_m, &residual) &&
        residual < smallest_residual) {
      smallest_residual = residual;
      *previous_from_current = RigidTransform(Eigen::Quaterniond(rotation), translation_m);
    }
  }
  return std::isfinite(smallest_residual) ? SolverStatus::kOk : SolverStatus::kDegenerate;
}

}  // namespace vcharge
