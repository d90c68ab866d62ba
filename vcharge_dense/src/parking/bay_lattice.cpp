#include "parking/bay_lattice.h"

#include <algorithm>
#include <cmath>

#include <Eigen/Cholesky>
#include <Eigen/LU>

#include "vcharge_core/base/quantile.h"

namespace vcharge {
namespace {

constexpr double kAcrossTolerance_m = 0.15;
constexpr int kMostBays = 60;

}  // namespace

Eigen::Vector2d BayLattice::coordinatesOf(const Eigen::Vector2d& position_m) const {
  Eigen::Matrix2d axes;
  axes << step_m, into;
  return axes.inverse() * (position_m - entry_m);
}

double BayLattice::width_m() const {
  return std::abs(rightOf(into).dot(step_m));
}

bool BayLattice::isAtRightAngles() const {
  constexpr double kSine = 0.9986;  // 87 degrees
  return sine() > kSine;
}

bool BayLattice::beginsAtLane(const DividerLine& line) const {
  return std::abs(coordinatesOf(line.entry_m).y()) < kEntryTolerance_m;
}

LatticeLines linesOn(const BayLattice& lattice, const std::vector<DividerLine>& lines,
                     const std::vector<bool>& is_used, const BaySizes& sizes, double growth) {
  LatticeLines found;
  std::map<int, double> error_of;
  for (const DividerLine& candidate : lines) {
    if (is_used[candidate.line] || candidate.direction().dot(lattice.into) < kSameDirection) {
      continue;
    }
    const Eigen::Vector2d middle = lattice.coordinatesOf(candidate.middle_m());
    const double begin_m = lattice.coordinatesOf(candidate.entry_m).y();
    const double nearest = std::round(middle.x());
    const double error_m = std::abs(middle.x() - nearest) * lattice.width_m();
    if (std::abs(nearest) > kMostBays ||
        error_m > kAcrossTolerance_m + std::min(0.3, growth * std::abs(nearest) * lattice.width_m()) ||
        begin_m < -kEntryTolerance_m || begin_m > sizes.max_length - kMinVisible_m) {
      continue;
    }
    // Lines that begin at the lane are better than others.
    const double cost = error_m + std::min(begin_m, 1.0);
    const int index = static_cast<int>(nearest);
    if (const auto known = error_of.find(index); known == error_of.end() || cost < known->second) {
      found[index] = candidate;
      error_of[index] = cost;
    }
  }
  return found;
}

bool isFilled(const BayLattice& lattice, const LatticeLines& lines, const std::vector<DividerLine>& all) {
  constexpr double kBetween = 0.2;  // of a bay's width, from its dividers
  std::vector<double> lengths_m;
  for (const auto& [index, candidate] : lines) {
    lengths_m.push_back(candidate.length_m());
  }
  const double least_m = 0.5 * quantile(lengths_m, 0.5);
  size_t count = 0;
  for (const DividerLine& candidate : all) {
    const Eigen::Vector2d middle = lattice.coordinatesOf(candidate.middle_m());
    const double begin_m = lattice.coordinatesOf(candidate.entry_m).y();
    const bool is_parallel =
        candidate.direction().dot(lattice.into) >= kSameDirection && candidate.length_m() >= least_m;
    count += is_parallel && middle.x() > lines.begin()->first && middle.x() < lines.rbegin()->first &&
                     std::abs(middle.x() - std::round(middle.x())) > kBetween &&
                     std::abs(begin_m) < kEntryTolerance_m
                 ? 1
                 : 0;
  }
  return 2 * count >= lines.size();
}

BayLattice adjusted(const BayLattice& lattice, const LatticeLines& lines) {
  constexpr double kAcrossSigma_m = 0.02, kEndSigma_m = 0.06;
  BayLattice result = lattice;
  result.into.setZero();
  for (const auto& [index, candidate] : lines) {
    result.into += candidate.far_m - candidate.entry_m;
  }
  result.into.normalize();
  const Eigen::Vector2d normal = rightOf(result.into);
  Eigen::Matrix4d information = 1e-6 * Eigen::Matrix4d::Identity();
  Eigen::Vector4d start, vector;
  start << lattice.entry_m, lattice.step_m;
  vector = information * start;
  const auto add = [&](int index, const Eigen::Vector2d& direction, const Eigen::Vector2d& position_m,
                       double sigma_m) {
    Eigen::Vector4d row;
    row << direction, index * direction;
    information += row * row.transpose() / (sigma_m * sigma_m);
    vector += row * direction.dot(position_m) / (sigma_m * sigma_m);
  };
  for (const auto& [index, candidate] : lines) {
    add(index, normal, candidate.middle_m(), kAcrossSigma_m);
    if (lattice.beginsAtLane(candidate)) {
      add(index, result.into, candidate.entry_m, kEndSigma_m);
    }
  }
  if (lattice.isAtRightAngles()) {
    constexpr double kRightAngleSigma_m = 0.005;  // per step
    Eigen::Vector4d row;
    row << 0.0, 0.0, result.into;
    information += row * row.transpose() / (kRightAngleSigma_m * kRightAngleSigma_m);
  }
  const Eigen::Vector4d solution = information.ldlt().solve(vector);
  result.entry_m = solution.head<2>();
  result.step_m = solution.tail<2>();
  return result;
}

}  // namespace vcharge
