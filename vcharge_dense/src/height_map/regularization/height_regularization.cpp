#include "height_map/regularization/height_regularization.h"

#include <cmath>
#include <limits>

namespace vcharge {
namespace {

constexpr float kNan = std::numeric_limits<float>::quiet_NaN();
constexpr float kInfinite = std::numeric_limits<float>::infinity();

// Weights of the data in the paper's two energies; alpha_1 and alpha_2 are 1. Gradients are differences
// between neighbouring cells, so that all three are per cell.
constexpr double kLabelLambda = 0.1;
constexpr float kHeightLambda = 2.0F;
constexpr float kHuberEpsilon_m = 0.002F;  // larger values draw ramps before distant kerbs

constexpr PrimalDualSettings kLabelSolver{1e-3, 4000, 1.0};

}  // namespace

cv::Mat labelObserved(const ColumnImages& columns, double gamma, PrimalDualReport* report) {
  const cv::Size size = columns.best_height_m.size();
  VariationalProblem problem;
  problem.floor = cv::Mat(size, CV_32FC1, cv::Scalar(-kInfinite));
  problem.ceiling = cv::Mat(size, CV_32FC1, cv::Scalar(kInfinite));
  problem.slope.create(size, CV_32FC1);
  cv::Mat start(size, CV_32FC1);
  for (int row = 0; row < size.height; ++row) {
    for (int column = 0; column < size.width; ++column) {
      // Cost l (C^min + gamma) + (1 - l) C^occ without the part that does not depend on the label l.
      const bool has_surface = !std::isnan(columns.best_height_m.at<float>(row, column));
      const float gain = has_surface ? columns.occupied_gain.at<float>(row, column) : 0.0F;
      const auto slope = static_cast<float>(kLabelLambda * (gamma - gain));
      problem.slope.at<float>(row, column) = slope;
      start.at<float>(row, column) = slope < 0.0F ? 1.0F : 0.0F;
    }
  }
  const cv::Mat label = solveVariational(problem, start, kLabelSolver, report);
  return label > 0.5;
}

cv::Mat smoothHeights(const ColumnImages& columns, const cv::Mat& observed, const VoxelGrid& grid,
                      PrimalDualReport* report) {
  const cv::Size size = columns.best_height_m.size();
  const auto delta = static_cast<float>(0.5 * grid.height_step_m);
  VariationalProblem problem;
  problem.floor.create(size, CV_32FC1);
  problem.ceiling.create(size, CV_32FC1);
  problem.below = problem.above = kHeightLambda;
  problem.epsilon = kHuberEpsilon_m;
  problem.weight_below = columns.support_below;
  problem.weight_above = columns.support_above;
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
  return solveVariational(problem, columns.best_height_m, PrimalDualSettings(), report);
}

}  // namespace vcharge
