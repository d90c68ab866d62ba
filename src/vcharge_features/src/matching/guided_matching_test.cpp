#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <random>

#include "vcharge_features/descriptor_matching.h"

namespace vcharge {
namespace {

struct Problem {
  cv::Mat first, second;
  std::vector<cv::Point2f> predicted, positions;
};

Problem randomProblem(int num_first, int num_second, bool binary, unsigned seed) {
  std::mt19937 generator(seed);
  Problem problem;
  for (auto* mat : {&problem.first, &problem.second}) {
    const int rows = mat == &problem.first ? num_first : num_second;
    *mat = cv::Mat(rows, 32, binary ? CV_8UC1 : CV_32FC1);
    auto* points = mat == &problem.first ? &problem.predicted : &problem.positions;
    for (int i = 0; i < rows; ++i) {
      for (int k = 0; k < 32; ++k) {
        // Few different values cause ties.
        const unsigned value = generator() % 3;
        if (binary) {
          mat->at<uint8_t>(i, k) = static_cast<uint8_t>(k == 0 ? value : 0);
        } else {
          mat->at<float>(i, k) = static_cast<float>(value);
        }
      }
      points->emplace_back(static_cast<float>(generator() % 100), static_cast<float>(generator() % 60));
    }
  }
  return problem;
}

double distanceOf(const Problem& problem, int i, int j) {
  return cv::norm(problem.first.row(i), problem.second.row(j),
                  problem.first.type() == CV_8UC1 ? cv::NORM_HAMMING : cv::NORM_L2);
}

/// Exhaustive search that skips candidates outside the radius.
std::vector<FeatureMatch> matchPlainly(const Problem& problem, const MatchOptions& options,
                                       const std::function<bool(int, int)>& near) {
  std::vector<FeatureMatch> matches;
  const auto nearest = [&](int i) {
    int best = -1;
    double best_distance = INFINITY, second_distance = INFINITY;
    for (int j = 0; j < problem.second.rows; ++j) {
      const double distance = near(i, j) ? distanceOf(problem, i, j) : INFINITY;
      if (distance < best_distance) {
        second_distance = best_distance;
        best_distance = distance;
        best = j;
      } else {
        second_distance = std::min(second_distance, distance);
      }
    }
    const bool distinct =
        options.max_ratio == 1.0 || std::isinf(second_distance) ||
        static_cast<float>(best_distance) < options.max_ratio * static_cast<float>(second_distance);
    return std::make_pair(distinct ? best : -1, best_distance);
  };
  for (int i = 0; i < problem.first.rows; ++i) {
    const auto [j, distance] = nearest(i);
    bool is_mutual = j >= 0;
    for (int other = 0; j >= 0 && other < problem.first.rows; ++other) {
      if (near(other, j)) {
        const double other_distance = distanceOf(problem, other, j);
        is_mutual &= !(other_distance < distance || (other_distance == distance && other < i));
      }
    }
    if (j >= 0 && is_mutual) {
      matches.push_back({i, j, static_cast<float>(distance)});
    }
  }
  return matches;
}

void expectEqual(const std::vector<FeatureMatch>& expected, const std::vector<FeatureMatch>& found) {
  ASSERT_EQ(expected.size(), found.size());
  for (size_t i = 0; i < expected.size(); ++i) {
    EXPECT_EQ(expected[i].first_index, found[i].first_index);
    EXPECT_EQ(expected[i].second_index, found[i].second_index);
    EXPECT_FLOAT_EQ(expected[i].distance, found[i].distance);
  }
}

TEST(GuidedMatchingTest, EqualsAnExhaustiveSearchThatLeavesOutWhatIsTooFar) {
  unsigned seed = 0;
  size_t total = 0;
  for (const bool binary : {true, false}) {
    for (const double radius_px : {0.5, 5.0, 13.0, 200.0}) {
      for (const double max_ratio : {0.7, 1.0}) {
        const Problem problem = randomProblem(37, 61, binary, ++seed);
        MatchOptions options;
        options.max_ratio = max_ratio;
        const std::vector<FeatureMatch> found = matchNearPixels(
            problem.first, problem.predicted, problem.second, problem.positions, radius_px, options);
        expectEqual(matchPlainly(problem, options,
                                 [&](int i, int j) {
                                   return cv::norm(problem.predicted[i] - problem.positions[j]) <= radius_px;
                                 }),
                    found);
        total += found.size();
      }
    }
  }
  EXPECT_GT(total, 100U) << "nothing was compared";
}

TEST(GuidedMatchingTest, DirectionsEqualAnExhaustiveSearchThatLeavesOutWhatIsTooFar) {
  std::mt19937 generator(9);
  std::normal_distribution<double> normal;
  const Problem problem = randomProblem(50, 70, true, 77);
  Eigen::Matrix3Xd predicted(3, 50), rays(3, 70);
  for (Eigen::Matrix3Xd* matrix : {&predicted, &rays}) {
    for (Eigen::Index i = 0; i < matrix->cols(); ++i) {
      matrix->col(i) = Eigen::Vector3d(normal(generator), normal(generator), normal(generator)).normalized();
    }
  }
  for (const double radius_rad : {0.01, 0.3, 1.0, 3.0}) {
    expectEqual(matchPlainly(
                    problem, MatchOptions(),
                    [&](int i, int j) { return std::acos(predicted.col(i).dot(rays.col(j))) <= radius_rad; }),
                matchNearRays(problem.first, predicted, problem.second, rays, radius_rad));
  }
}

TEST(GuidedMatchingTest, PositionsThatAreNotFiniteMatchNothing) {
  Problem problem = randomProblem(3, 3, true, 5);
  problem.second = problem.first.clone();
  problem.positions = problem.predicted;
  MatchOptions options;
  options.max_ratio = 1.0;
  problem.predicted[0].x = NAN;
  problem.positions[1].y = INFINITY;
  for (const FeatureMatch& match :
       matchNearPixels(problem.first, problem.predicted, problem.second, problem.positions, 1e4, options)) {
    EXPECT_NE(match.first_index, 0);
    EXPECT_NE(match.second_index, 1);
  }
}

TEST(GuidedMatchingTest, BadArgumentsAreNamed) {
  const auto throwing = [](const char* text) {
    return ::testing::ThrowsMessage<std::invalid_argument>(::testing::HasSubstr(text));
  };
  Problem problem = randomProblem(3, 4, true, 5);
  const auto match = [&](double radius_px) {
    return matchNearPixels(problem.first, problem.predicted, problem.second, problem.positions, radius_px);
  };
  EXPECT_THAT([&] { match(NAN); }, throwing("radius_px"));
  EXPECT_THAT([&] { match(0.0); }, throwing("radius_px"));
  EXPECT_THAT([&] { matchNearRays(problem.first, {}, problem.second, {}, 4.0); }, throwing("radius_rad"));
  problem.positions.pop_back();
  EXPECT_THAT([&] { match(1.0); }, throwing("second positions: expected one position per descriptor (4)"));
  problem.predicted.pop_back();
  EXPECT_THAT([&] { match(1.0); }, throwing("predicted positions"));
  EXPECT_TRUE(matchNearPixels(cv::Mat(), {}, cv::Mat(), {}, 1.0).empty());
}

}  // namespace
}  // namespace vcharge
