#include "features/epipolar_judge.h"

#include <algorithm>
#include <cmath>
#include <random>
#include <vector>

#include <Eigen/Eigenvalues>
#include <Eigen/SVD>

#include "vcharge_core/base/error.h"
#include "vcharge_core/motion/cross_matrix.h"

namespace vcharge {
namespace {

constexpr int kSampleSize = 8;
using Matrix9d = Eigen::Matrix<double, 9, 9>;
using Vector9d = Eigen::Matrix<double, 9, 1>;

/// Essential matrix E of second^T E first = 0 over the chosen correspondences.
Eigen::Matrix3d fitEssential(const Eigen::Matrix3Xd& first, const Eigen::Matrix3Xd& second,
                             const std::vector<int>& chosen) {
  Matrix9d normal = Matrix9d::Zero();
  for (const int i : chosen) {
    Vector9d row;
    for (int r = 0; r < 3; ++r) {
      row.segment<3>(3 * r) = second(r, i) * first.col(i);
    }
    normal.selfadjointView<Eigen::Lower>().rankUpdate(row);
  }
  const Eigen::SelfAdjointEigenSolver<Matrix9d> eigen(normal);
  const Vector9d solution = eigen.eigenvectors().col(0);
  const Eigen::Matrix3d matrix =
      Eigen::Map<const Eigen::Matrix<double, 3, 3, Eigen::RowMajor>>(solution.data());
  const Eigen::JacobiSVD<Eigen::Matrix3d> svd(matrix, Eigen::ComputeFullU | Eigen::ComputeFullV);
  return svd.matrixU() * Eigen::Vector3d(1.0, 1.0, 0.0).asDiagonal() * svd.matrixV().transpose();
}

/// Larger sine of the angles of each correspondence's rays to their epipolar planes; NaN where a ray is.
Eigen::VectorXd epipolarErrors(const Eigen::Matrix3d& essential, const Eigen::Matrix3Xd& first,
                               const Eigen::Matrix3Xd& second) {
  Eigen::VectorXd errors(first.cols());
  for (Eigen::Index i = 0; i < first.cols(); ++i) {
    const Eigen::Vector3d normal_in_second = essential * first.col(i);
    const Eigen::Vector3d normal_in_first = essential.transpose() * second.col(i);
    errors[i] = std::abs(second.col(i).dot(normal_in_second)) /
                std::sqrt(std::min(normal_in_second.squaredNorm(), normal_in_first.squaredNorm()));
  }
  return errors;
}

std::vector<int> below(const Eigen::VectorXd& errors, double max_error) {
  std::vector<int> agree;
  for (Eigen::Index i = 0; i < errors.size(); ++i) {
    if (errors[i] < max_error) {  // false for NaN
      agree.push_back(static_cast<int>(i));
    }
  }
  return agree;
}

double medianOf(const Eigen::VectorXd& errors, const std::vector<int>& chosen) {
  std::vector<double> values;
  for (const int i : chosen) {
    values.push_back(errors[i]);
  }
  std::sort(values.begin(), values.end());
  return values.empty() ? 0.0 : std::asin(values[values.size() / 2]);
}

}  // namespace

EpipolarJudgement judgeMatches(const Eigen::Matrix3Xd& first_rays, const Eigen::Matrix3Xd& second_rays,
                               double max_error_rad, unsigned seed, int num_samples) {
  check(first_rays.cols() == second_rays.cols(), "judgeMatches: as many first rays as second ones");
  EpipolarJudgement judgement;
  const auto count = static_cast<unsigned>(first_rays.cols());
  if (count < kSampleSize) {
    return judgement;
  }
  const double max_error = std::sin(max_error_rad);
  std::mt19937 generator(seed);
  std::vector<int> sample(kSampleSize);
  for (int iteration = 0; iteration < num_samples; ++iteration) {
    for (int k = 0; k < kSampleSize; ++k) {
      do {
        sample[k] = static_cast<int>(generator() % count);
      } while (std::find(sample.begin(), sample.begin() + k, sample[k]) != sample.begin() + k);
    }
    Eigen::Matrix3d essential = fitEssential(first_rays, second_rays, sample);
    if (!essential.allFinite()) {
      continue;
    }
    Eigen::VectorXd errors = epipolarErrors(essential, first_rays, second_rays);
    if (2 * below(errors, max_error).size() < static_cast<size_t>(judgement.right)) {
      continue;
    }
    // Eight points err themselves: refined on all that agree, at first roughly.
    for (const double factor : {3.0, 2.0, 1.5, 1.0, 1.0, 1.0}) {
      const std::vector<int> inliers = below(errors, factor * max_error);
      if (inliers.size() < kSampleSize) {
        break;
      }
      essential = fitEssential(first_rays, second_rays, inliers);
      errors = epipolarErrors(essential, first_rays, second_rays);
      const std::vector<int> right = below(errors, max_error);
      if (right.size() > static_cast<size_t>(judgement.right)) {
        judgement = {static_cast<int>(right.size()), medianOf(errors, right)};
      }
    }
  }
  return judgement;
}

EpipolarJudgement judgeMatches(const Eigen::Matrix3Xd& first_rays, const Eigen::Matrix3Xd& second_rays,
                               double max_error_rad, const RigidTransform& second_from_first) {
  check(first_rays.cols() == second_rays.cols(), "judgeMatches: as many first rays as second ones");
  const Eigen::VectorXd errors =
      epipolarErrors(crossMatrix(second_from_first.translation()) * second_from_first.rotationMatrix(),
                     first_rays, second_rays);
  const std::vector<int> right = below(errors, std::sin(max_error_rad));
  return {static_cast<int>(right.size()), medianOf(errors, right)};
}

}  // namespace vcharge
