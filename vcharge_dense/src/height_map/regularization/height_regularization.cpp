#include "height_map/regularization/height_regularization.h"

#include <cmath>
#include <limits>

namespace vcharge {
namespace {

constexpr float kNan = std::numeric_limits<float>::quiet_NaN();
constexpr float kInfinite = std::numeric_limits<float>::infinity();

}  // namespace

cv::Mat labelObserved(const ColumnImages& columns, const HeightRegularizationOptions& options,
                      PrimalDualReport* report) {
  const cv::Size size = columns.best_height_m.size();
  VariationalProblem problem;
  problem.floor = cv::Mat(size, CV_32FC1, cv::Scalar(-kInfinite));
  problem.ceiling = cv::Mat(size, CV_32FC1, cv::Scalar(kInfinite));
  problem.slope.create(size, CV_32FC1);
  cv::Mat start(size, CV_32FC1);
  for (int row = 0; row < size.height; ++row) {
    for (int column = 0; column < size.width; ++column) {
      // l (C^min + gamma) + (1 - l) C^occ, less what does not depend on l.
      const bool has_surface = !std::isnan(columns.best_height_m.at<float>(row, column));
      const float gain = has_surface ? columns.occupied_gain.at<float>(row, column) : 0.0F;
      const auto slope = static_cast<float>(options.label_lambda * (options.label_gamma - gain));
      problem.slope.at<float>(row, column) = slope;
      start.at<float>(row, column) = slope < 0.0F ? 1.0F : 0.0F;
    }
  }
  const cv::Mat label = solveVariational(problem, start, options.label_solver, report);
  return label > 0.5;
}

cv::Mat smoothHeights(const ColumnImages& columns, const cv::Mat& observed, const VoxelGrid& grid,
                      const HeightRegularizationOptions& options, PrimalDualReport* report) {
  const cv::Size size = columns.best_height_m.size();
  const auto delta = static_cast<float>(0.5 * grid.height_step_m);
  VariationalProblem problem;
  problem.floor.create(size, CV_32FC1);
  problem.ceiling.create(size, CV_32FC1);
  problem.below = static_cast<float>(options.height_lambda * options.alpha_up);
  problem.above = static_cast<float>(options.height_lambda * options.alpha_down);
  problem.epsilon = static_cast<float>(options.huber_epsilon_m);
  const double share = options.confidence_weighting;
  problem.weight_below = cv::Mat(columns.support_below * share + (1.0 - share));
  problem.weight_above = cv::Mat(columns.support_above * share + (1.0 - share));
  problem.low = static_cast<float>(grid.bottom_m);
  problem.high = static_cast<float>(grid.top_m());
  for (int row = 0; row < size.height; ++row) {
    for (int column = 0; column < size.width; ++column) {
      const float best = columns.best_height_m.at<float>(row, column);
      const bool is_observed = observed.at<uint8_t>(row, column) != 0;
      const bool has_surface = !std::isnan(best);
      problem.floor.at<float>(row, column) = !is_observed ? kNan : has_surface ? best - delta : -kInfinite;
      problem.ceiling.at<float>(row, column) = !is_observed ? kNan : has_surface ? best + delta : kInfinite;
    }
  }
  return solveVariational(problem, columns.best_height_m, options.height_solver, report);
}

}  // namespace vcharge
