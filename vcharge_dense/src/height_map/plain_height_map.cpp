#include "height_map/plain_height_map.h"

#include <algorithm>
#include <cmath>
#include <limits>

namespace vcharge {
namespace {

float gradient(const cv::Mat& values, int row, int column, int row_step, int column_step) {
  if (row + row_step >= values.rows || column + column_step >= values.cols) {
    return 0.0F;
  }
  const float difference =
      values.at<float>(row + row_step, column + column_step) - values.at<float>(row, column);
  return std::isnan(difference) ? 0.0F : difference;
}

float weightAt(const cv::Mat& weights, int row, int column) {
  return weights.empty() ? 1.0F : weights.at<float>(row, column);
}

}  // namespace

void addColumnWeightsPlain(const PackedRangeMap& map, const WeightProfile& profile, const VoxelColumn& column,
                           float* weights) {
  for (int z = 0; z < column.count; ++z) {
    const float x = column.first[0] + static_cast<float>(z) * column.step[0];
    const float y = column.first[1] + static_cast<float>(z) * column.step[1];
    const float depth = column.first[2] + static_cast<float>(z) * column.step[2];
    const float distance = std::sqrt(x * x + y * y + depth * depth);
    const float denominator = depth + map.xi * distance;
    if (distance >= profile.max_range_m || depth <= distance * map.min_cosine || denominator <= 1e-6F) {
      continue;
    }
    const float u = map.fx * x / denominator + map.u0, v = map.fy * y / denominator + map.v0;
    const float column_px = std::floor(u + 0.5F), row_px = std::floor(v + 0.5F);
    if (column_px < 0.0F || row_px < 0.0F || column_px >= static_cast<float>(map.width) ||
        row_px >= static_cast<float>(map.height)) {
      continue;
    }
    const float* pixel =
        map.values.data() +
        (static_cast<size_t>(row_px) * map.width + static_cast<size_t>(column_px)) * PackedRangeMap::kValues;
    const float rho = pixel[0] + pixel[1] * (u - column_px) + pixel[2] * (v - row_px);
    if (pixel[0] <= 0.0F || rho <= 1e-4F) {
      continue;
    }
    const float behind = distance - 1.0F / rho, sigma = pixel[3];
    const float ramp = std::max(sigma, profile.min_ramp_m);
    if (behind > profile.band_m + ramp) {
      continue;
    }
    const float side = std::clamp(behind / ramp, -1.0F, 1.0F);
    weights[z] += (side < 0.0F ? profile.free_weight * side : side) * pixel[4];
  }
}

PlainPrimalDual::PlainPrimalDual(const VariationalProblem& problem, const cv::Mat& start, double step_ratio)
    : problem_(problem),
      primal_step_(static_cast<float>(step_ratio / std::sqrt(8.0))),
      dual_step_(static_cast<float>(1.0 / (step_ratio * std::sqrt(8.0)))),
      dual_x_(start.size(), CV_32FC1, cv::Scalar(0)),
      dual_y_(start.size(), CV_32FC1, cv::Scalar(0)) {
  value_ = start.clone();
  for (int row = 0; row < value_.rows; ++row) {
    for (int column = 0; column < value_.cols; ++column) {
      float& value = value_.at<float>(row, column);
      value = std::isnan(problem.floor.at<float>(row, column)) ? std::numeric_limits<float>::quiet_NaN()
              : std::isnan(value)                              ? problem.low
                                                               : std::clamp(value, problem.low, problem.high);
    }
  }
  extrapolated_ = value_.clone();
}

void PlainPrimalDual::iterate() {
  for (int row = 0; row < value_.rows; ++row) {
    for (int column = 0; column < value_.cols; ++column) {
      const float shrink = 1.0F / (1.0F + dual_step_ * problem_.epsilon);
      const float x =
          shrink * (dual_x_.at<float>(row, column) + dual_step_ * gradient(extrapolated_, row, column, 0, 1));
      const float y =
          shrink * (dual_y_.at<float>(row, column) + dual_step_ * gradient(extrapolated_, row, column, 1, 0));
      const float norm = std::max(1.0F, std::sqrt(x * x + y * y));
      dual_x_.at<float>(row, column) = x / norm;
      dual_y_.at<float>(row, column) = y / norm;
    }
  }
  for (int row = 0; row < value_.rows; ++row) {
    for (int column = 0; column < value_.cols; ++column) {
      const float floor = problem_.floor.at<float>(row, column);
      if (std::isnan(floor)) {
        continue;
      }
      const float ceiling = problem_.ceiling.at<float>(row, column);
      const float slope = problem_.slope.empty() ? 0.0F : problem_.slope.at<float>(row, column);
      const float weight_below = weightAt(problem_.weight_below, row, column);
      const float weight_above = weightAt(problem_.weight_above, row, column);
      const float divergence =
          dual_x_.at<float>(row, column) - (column > 0 ? dual_x_.at<float>(row, column - 1) : 0.0F) +
          dual_y_.at<float>(row, column) - (row > 0 ? dual_y_.at<float>(row - 1, column) : 0.0F);
      const float before = value_.at<float>(row, column);
      float after = before + primal_step_ * (divergence - slope);
      if (after < floor) {
        after = std::min(floor, after + primal_step_ * weight_below * problem_.below);
      } else if (after > ceiling) {
        after = std::max(ceiling, after - primal_step_ * weight_above * problem_.above);
      }
      after = std::clamp(after, problem_.low, problem_.high);
      value_.at<float>(row, column) = after;
      extrapolated_.at<float>(row, column) = 2.0F * after - before;
    }
  }
}

double plainEnergy(const VariationalProblem& problem, const cv::Mat& values) {
  double energy = 0.0;
  for (int row = 0; row < values.rows; ++row) {
    for (int column = 0; column < values.cols; ++column) {
      const double value = values.at<float>(row, column);
      if (std::isnan(value)) {
        continue;
      }
      const double norm =
          std::hypot(gradient(values, row, column, 0, 1), gradient(values, row, column, 1, 0));
      const double epsilon = problem.epsilon;
      energy += norm < epsilon ? norm * norm / (2.0 * epsilon) : norm - 0.5 * epsilon;
      energy += weightAt(problem.weight_below, row, column) * problem.below *
                std::max(0.0, problem.floor.at<float>(row, column) - value);
      energy += weightAt(problem.weight_above, row, column) * problem.above *
                std::max(0.0, value - problem.ceiling.at<float>(row, column));
      energy += problem.slope.empty() ? 0.0 : problem.slope.at<float>(row, column) * value;
    }
  }
  return energy;
}

}  // namespace vcharge
