#include "height_map/regularization/primal_dual.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <random>

#include <gtest/gtest.h>
#include <tbb/global_control.h>

#include "height_map/plain_height_map.h"

namespace vcharge {
namespace {

constexpr float kNan = std::numeric_limits<float>::quiet_NaN();
constexpr float kInfinite = std::numeric_limits<float>::infinity();

struct Case {
  VariationalProblem problem;
  cv::Mat start;
};

/// Noisy heights with a step, holes in the domain, cells without data, and data of different weights.
Case heightCase(cv::Size size, uint32_t seed) {
  std::mt19937 random(seed);
  std::uniform_real_distribution<float> uniform(0.0F, 1.0F);
  Case c;
  c.start.create(size, CV_32FC1);
  c.problem.floor.create(size, CV_32FC1);
  c.problem.ceiling.create(size, CV_32FC1);
  c.problem.weight_below.create(size, CV_32FC1);
  c.problem.weight_above.create(size, CV_32FC1);
  for (int row = 0; row < size.height; ++row) {
    for (int column = 0; column < size.width; ++column) {
      const float height = (column > size.width / 2 ? 0.4F : 0.0F) + 0.2F * uniform(random);
      const float kind = uniform(random);
      c.start.at<float>(row, column) = height;
      c.problem.weight_below.at<float>(row, column) = 2.0F * uniform(random);
      c.problem.weight_above.at<float>(row, column) = 2.0F * uniform(random);
      c.problem.floor.at<float>(row, column) = kind < 0.1F ? kNan : kind < 0.2F ? -kInfinite : height - 0.02F;
      c.problem.ceiling.at<float>(row, column) = kind < 0.1F   ? kNan
                                                 : kind < 0.2F ? kInfinite
                                                               : height + 0.02F;
    }
  }
  c.problem.below = 0.8F;
  c.problem.above = 0.6F;
  c.problem.epsilon = 0.05F;
  c.problem.low = -0.5F;
  c.problem.high = 1.0F;
  return c;
}

Case labelCase(cv::Size size, uint32_t seed) {
  std::mt19937 random(seed);
  std::normal_distribution<float> normal(0.0F, 1.0F);
  Case c;
  c.start = cv::Mat(size, CV_32FC1, cv::Scalar(0.5));
  c.problem.floor = cv::Mat(size, CV_32FC1, cv::Scalar(-kInfinite));
  c.problem.ceiling = cv::Mat(size, CV_32FC1, cv::Scalar(kInfinite));
  c.problem.slope.create(size, CV_32FC1);
  for (int row = 0; row < size.height; ++row) {
    for (int column = 0; column < size.width; ++column) {
      c.problem.slope.at<float>(row, column) = (column > size.width / 2 ? -0.5F : 0.5F) + normal(random);
    }
  }
  return c;
}

double largestDifference(const cv::Mat& a, const cv::Mat& b) {
  double largest = 0.0;
  for (int row = 0; row < a.rows; ++row) {
    for (int column = 0; column < a.cols; ++column) {
      const float x = a.at<float>(row, column), y = b.at<float>(row, column);
      if (std::isnan(x) != std::isnan(y)) {
        return kInfinite;
      }
      largest = std::isnan(x) ? largest : std::max<double>(largest, std::abs(x - y));
    }
  }
  return largest;
}

TEST(PrimalDualTest, EqualsThePlainLoop) {
  // More than one band of rows, and columns that do not fill a vector.
  for (const Case& c : {heightCase({77, 300}, 1), heightCase({5, 3}, 2), labelCase({130, 140}, 3)}) {
    PrimalDualSolver solver(c.problem, c.start, 0.1);
    PlainPrimalDual plain(c.problem, c.start, 0.1);
    for (int i = 0; i < 5; ++i) {
      solver.iterate();
      for (int k = 0; k < PrimalDualSolver::kIterationsAtOnce; ++k) {
        plain.iterate();
      }
      EXPECT_LT(largestDifference(solver.values(), plain.values()), 2e-5);
    }
  }
}

TEST(PrimalDualTest, IsTheSameOnAnyNumberOfThreads) {
  const Case c = heightCase({200, 700}, 4);
  cv::Mat results[2];
  for (int i = 0; i < 2; ++i) {
    const tbb::global_control threads(tbb::global_control::max_allowed_parallelism, i == 0 ? 1 : 4);
    PrimalDualSolver solver(c.problem, c.start, 0.1);
    for (int k = 0; k < 6; ++k) {
      solver.iterate();
    }
    results[i] = solver.values();
  }
  EXPECT_EQ(largestDifference(results[0], results[1]), 0.0);
}

/// Expects that no change of a rectangle of cells lowers the energy by more than the duality gap.
void expectOptimal(const Case& c, double max_gap) {
  PrimalDualReport report;
  PrimalDualSettings options;
  options.max_gap_per_cell = max_gap;
  options.max_iterations = 200000;
  const cv::Mat solution = solveVariational(c.problem, c.start, options, &report);
  ASSERT_TRUE(report.converged);
  const double energy = plainEnergy(c.problem, solution);
  EXPECT_NEAR(report.primal_energy, energy, 1e-4 * (1.0 + std::abs(energy)));
  EXPECT_GE(report.gap, -1e-4);

  // Many plain iterations from another start reach the same energy.
  cv::Mat other(c.start.size(), CV_32FC1, cv::Scalar(c.problem.high));
  PlainPrimalDual plain(c.problem, other, 0.3);
  for (int i = 0; i < 60000; ++i) {
    plain.iterate();
  }
  const double reference = plainEnergy(c.problem, plain.values());
  EXPECT_LE(energy, reference + report.gap + 1e-4);
  EXPECT_GE(energy, reference - 1e-3);

  std::mt19937 random(5);
  for (int trial = 0; trial < 3000; ++trial) {
    const cv::Point a(static_cast<int>(random() % solution.cols), static_cast<int>(random() % solution.rows));
    const cv::Point b(static_cast<int>(random() % solution.cols), static_cast<int>(random() % solution.rows));
    cv::Mat changed = solution.clone();
    const float shift = 0.2F * (static_cast<float>(random() % 2001) / 1000.0F - 1.0F);
    cv::Mat part = changed(cv::Rect(cv::Point(std::min(a.x, b.x), std::min(a.y, b.y)),
                                    cv::Size(std::abs(a.x - b.x) + 1, std::abs(a.y - b.y) + 1)));
    for (int row = 0; row < part.rows; ++row) {
      for (int column = 0; column < part.cols; ++column) {
        float& value = part.at<float>(row, column);
        value = std::isnan(value) ? value : std::clamp(value + shift, c.problem.low, c.problem.high);
      }
    }
    EXPECT_GE(plainEnergy(c.problem, changed), energy - report.gap - 1e-4);
  }
}

TEST(PrimalDualTest, FindsTheLeastEnergyOfSmallHeightMaps) {
  expectOptimal(heightCase({12, 9}, 11), 1e-5);
  expectOptimal(heightCase({7, 7}, 12), 1e-5);
}

TEST(PrimalDualTest, FindsTheLeastEnergyOfSmallLabellings) {
  expectOptimal(labelCase({9, 8}, 13), 1e-5);
}

TEST(PrimalDualTest, LabelsLikeAnExhaustiveSearch) {
  // Thresholding the relaxed solution gives an optimal labelling where the total variation is anisotropic
  // (Chan, Esedoglu and Nikolova 2006). Along a line of cells the isotropic variation is the same.
  const int num_cells = 14;
  for (uint32_t seed = 20; seed < 26; ++seed) {
    const Case c = labelCase({num_cells, 1}, seed);
    PrimalDualReport report;
    PrimalDualSettings options;
    options.max_gap_per_cell = 1e-6;
    options.max_iterations = 100000;
    const cv::Mat solution = solveVariational(c.problem, c.start, options, &report);
    cv::Mat rounded(1, num_cells, CV_32FC1), trial(1, num_cells, CV_32FC1);
    for (int i = 0; i < num_cells; ++i) {
      rounded.at<float>(i) = solution.at<float>(i) > 0.5F ? 1.0F : 0.0F;
    }
    double least = kInfinite;
    for (int code = 0; code < 1 << num_cells; ++code) {
      for (int i = 0; i < num_cells; ++i) {
        trial.at<float>(i) = (code >> i & 1) != 0 ? 1.0F : 0.0F;
      }
      least = std::min(least, plainEnergy(c.problem, trial));
    }
    EXPECT_NEAR(plainEnergy(c.problem, rounded), least, 1e-4);
  }
}

TEST(PrimalDualTest, LeavesAFlatBottomAlone) {
  Case c = heightCase({20, 20}, 6);
  c.problem.floor = cv::Mat(20, 20, CV_32FC1, cv::Scalar(0.1));
  c.problem.ceiling = cv::Mat(20, 20, CV_32FC1, cv::Scalar(0.3));
  c.start = cv::Mat(20, 20, CV_32FC1, cv::Scalar(0.2));
  PrimalDualReport report;
  const cv::Mat solution = solveVariational(c.problem, c.start, PrimalDualSettings(), &report);
  EXPECT_EQ(report.iterations, 0);
  EXPECT_NEAR(report.gap, 0.0, 1e-9);
  EXPECT_LT(largestDifference(solution, c.start), 1e-9);
}

TEST(PrimalDualTest, StaysWithinTheGridsHeights) {
  Case c = heightCase({20, 20}, 8);
  c.start.setTo(5.0F);
  c.problem.floor.setTo(4.9F);
  c.problem.ceiling.setTo(5.1F);
  c.problem.weight_below.setTo(1.0F);
  c.problem.weight_above.setTo(1.0F);
  PrimalDualReport report;
  const cv::Mat solution = solveVariational(c.problem, c.start, PrimalDualSettings(), &report);
  EXPECT_TRUE(report.converged);
  EXPECT_LT(largestDifference(solution, cv::Mat(20, 20, CV_32FC1, cv::Scalar(1.0))), 1e-6);
}

TEST(PrimalDualTest, AcceptsADomainWithoutCells) {
  Case c = heightCase({20, 20}, 9);
  c.problem.floor.setTo(kNan);
  PrimalDualReport report;
  const cv::Mat solution = solveVariational(c.problem, c.start, PrimalDualSettings(), &report);
  EXPECT_EQ(cv::countNonZero(solution == solution), 0);
  EXPECT_EQ(report.gap, 0.0);
}

}  // namespace
}  // namespace vcharge
