#include "epipolar_judge.h"

#include <algorithm>
#include <cmath>
#include <random>
#include <vector>

#include <Eigen/Eigenvalues>
#include <Eigen/SVD>

#include "vcharge_core/error.h"

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

/// The correspondences both of whose rays are within max_error_rad of their epipolar planes.
std::vector<int> agreeing(const Eigen::Matrix3d& essential, const Eigen::Matrix3Xd& first,
                          const Eigen::Matrix3Xd& second, double max_error_rad) {
  const double max_sine = std::sin(max_error_rad);
  std::vector<int> agree;
  for (Eigen::Index i = 0; i < first.cols(); ++i) {
    const Eigen::Vector3d normal_in_second = essential * first.col(i);
    const Eigen::Vector3d normal_in_first = essential.transpose() * second.col(i);
    const double product = std::abs(second.col(i).dot(normal_in_second));
    if (product < max_sine * normal_in_second.norm() && product < max_sine * normal_in_first.norm()) {
      agree.push_back(static_cast<int>(i));
    }
  }
  return agree;
}

}  // namespace

int countRightMatches(const Eigen::Matrix3Xd& first_rays, const Eigen::Matrix3Xd& second_rays,
                      double max_error_rad, unsigned seed, int num_samples) {
  check(first_rays.cols() == second_rays.cols(), "countRightMatches: as many first rays as second ones");
  const auto count = static_cast<unsigned>(first_rays.cols());
  if (count < kSampleSize) {
    return 0;
  }
  std::mt19937 generator(seed);
  size_t best = 0;
  std::vector<int> sample(kSampleSize);
  for (int iteration = 0; iteration < num_samples; ++iteration) {
    for (int k = 0; k < kSampleSize; ++k) {
      do {
        sample[k] = static_cast<int>(generator() % count);
      } while (std::find(sample.begin(), sample.begin() + k, sample[k]) != sample.begin() + k);
    }
    Eigen::Matrix3d essential = fitEssential(first_rays, second_rays, sample);
    if (!essential.allFinite() ||
        2 * agreeing(essential, first_rays, second_rays, max_error_rad).size() < best) {
      continue;
    }
    // Eight points err themselves: refined on all that agree, at first roughly.
    for (const double factor : {3.0, 2.0, 1.5, 1.0, 1.0, 1.0}) {
      const std::vector<int> inliers = agreeing(essential, first_rays, second_rays, factor * max_error_rad);
      if (inliers.size() < kSampleSize) {
        break;
      }
      essential = fitEssential(first_rays, second_rays, inliers);
      best = std::max(best, agreeing(essential, first_rays, second_rays, max_error_rad).size());
    }
  }
  return static_cast<int>(best);
}

}  // namespace vcharge
