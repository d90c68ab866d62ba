#include "vcharge_evaluation/step_errors.h"

#include <cmath>
#include <functional>

#include <gtest/gtest.h>

namespace vcharge {
namespace {

constexpr double kCell_m = 0.05;

/// True heights from x = 0 and y = -5, sampled at the middles of cells.
TruthHeights heightsOf(const std::function<double(double x_m, double y_m)>& height) {
  TruthHeights heights;
  heights.cell_size_m = kCell_m;
  heights.origin_m = {0.025, -4.975};
  heights.height_m.create(200, 400, CV_32FC1);
  for (int row = 0; row < 200; ++row) {
    for (int column = 0; column < 400; ++column) {
      heights.height_m.at<float>(row, column) =
          static_cast<float>(height(0.025 + kCell_m * column, -4.975 + kCell_m * row));
    }
  }
  return heights;
}

/// A kerb along y = 2, from x = 3 on, beside a lane along y = 0.
double kerb(double x_m, double y_m, double height_m) {
  return x_m > 3.0 && y_m > 2.0 ? height_m : 0.0;
}

std::vector<SeenPoint> allSeen() {
  std::vector<SeenPoint> seen;
  for (double x = 0.05; x < 20.0; x += 0.1) {
    for (double y = -4.95; y < 5.0; y += 0.1) {
      seen.push_back({Eigen::Vector3f(static_cast<float>(x), static_cast<float>(y), 0.0F)});
    }
  }
  return seen;
}

/// A map of even ground around the vehicle, in a fixed frame 10 m beside the world's.
StepMap mapAt(double vehicle_x_m) {
  StepMap map = StepMap::unknown({240, 240}, kCell_m);
  map.fixed_from_vehicle = RigidTransform::planar(vehicle_x_m, 10.0, 0.0);
  map.origin_m = {vehicle_x_m - 4.0, 4.0};
  map.height_m.setTo(0.0);
  return map;
}

void mark(StepMap* map, double world_x_m, double world_y_m, float height_m) {
  const Eigen::Vector2d cell = (Eigen::Vector2d(world_x_m, world_y_m + 10.0) - map->origin_m) / kCell_m;
  const cv::Point at(static_cast<int>(std::floor(cell.x())), static_cast<int>(std::floor(cell.y())));
  if (cv::Rect(cv::Point(), map->height_m.size()).contains(at)) {
    map->height_m.at<float>(at) = height_m;
  }
}

/// Drives 6 m along y = 0 with maps that report a step along y = report_y_m from x = from_m to 20 m.
StepErrors judge(const TruthHeights& heights, double report_y_m, double from_m,
                 const std::vector<SeenPoint>& seen = allSeen(),
                 const std::vector<TruthObstacle>& movers = {}) {
  StepEvaluator evaluator(heights);
  for (double x = 1.0; x <= 7.0; x += 0.5) {
    StepMap map = mapAt(x);
    for (double along = from_m; along < 20.0; along += 0.5 * kCell_m) {
      mark(&map, along, report_y_m, 0.1F);
    }
    evaluator.add(map, seen, RigidTransform::planar(x, 0.0, 0.0), movers);
  }
  return evaluator.errors();
}

TEST(StepTruthTest, IsAsLongAndAsHighAsTheStepsOfTheScene) {
  const StepTruth truth(heightsOf([](double x, double y) { return kerb(x, y, 0.1); }));
  double along_m = 0.0, across_m = 0.0;
  for (const TrueStep& step : truth.steps()) {
    EXPECT_NEAR(step.rise_m, 0.1, 1e-6);
    if (step.up.y() > 0.5) {
      EXPECT_NEAR(step.world_m.y(), 2.0, 1e-6);
      along_m += truth.cellSize_m();
    } else {
      EXPECT_GT(step.up.x(), 0.5);
      EXPECT_NEAR(step.world_m.x(), 3.0, 1e-6);
      across_m += truth.cellSize_m();
    }
  }
  EXPECT_NEAR(along_m, 17.0, 0.15);
  EXPECT_NEAR(across_m, 3.0, 0.15);
  EXPECT_FALSE(truth.isEven({8.0, 2.1}));
  EXPECT_TRUE(truth.isEven({8.0, 1.5}));
}

TEST(StepTruthTest, HolesAreStepsAndRampsTallThingsAndLowEdgesAreNot) {
  EXPECT_FALSE(StepTruth(heightsOf([](double x, double y) { return kerb(x, y, -0.08); })).steps().empty());
  EXPECT_TRUE(StepTruth(heightsOf([](double x, double y) { return kerb(x, y, 0.045); })).steps().empty());
  const StepTruth ramp(heightsOf([](double, double y) { return 0.2 * std::max(0.0, y - 2.0); }));
  EXPECT_TRUE(ramp.steps().empty());
  EXPECT_TRUE(ramp.isEven({8.0, 2.3}));
  const StepTruth wall(heightsOf([](double x, double y) { return kerb(x, y, 1.0); }));
  EXPECT_TRUE(wall.steps().empty());
  EXPECT_FALSE(wall.isEven({8.0, 1.7}));
  EXPECT_TRUE(wall.isEven({8.0, 1.4}));
  EXPECT_FALSE(
      StepTruth(heightsOf([](double x, double) { return x > 9.0 ? NAN : 0.0; })).isEven({10.0, 0.0}));
}

TEST(StepEvaluatorTest, FindsWhatIsReportedWithinTheToleranceAndNothingElse) {
  const TruthHeights heights = heightsOf([](double x, double y) { return kerb(x, y, 0.12); });
  const StepErrors near = judge(heights, 2.1, 3.0);
  EXPECT_GT(near.high.length_m, 5.0);
  EXPECT_EQ(near.low.num_due, 0U);
  EXPECT_NEAR(near.high.mean_height_error_m, -0.02, 1e-6);
  EXPECT_EQ(near.num_false_steps, 0U);
  EXPECT_NEAR(near.driven_m, 6.0, 1e-9);
  const StepErrors beside = judge(heights, 1.7, 3.0);
  EXPECT_EQ(beside.high.num_found, 0U);
  EXPECT_EQ(beside.num_false_steps, 1U);
  EXPECT_GT(beside.num_false_cells, 50U);
}

TEST(StepEvaluatorTest, ALowStepThatIsReportedFromItsMiddleOnIsFoundInPart) {
  const TruthHeights heights = heightsOf([](double, double y) { return y > 2.0 ? 0.06 : 0.0; });
  const StepErrors errors = judge(heights, 2.0, 6.0);
  EXPECT_EQ(errors.high.num_due, 0U);
  EXPECT_GT(errors.low.foundFraction(), 0.3);
  EXPECT_LT(errors.low.foundFraction(), 0.9);
  EXPECT_LT(errors.low.found_length_m, errors.low.length_m - 1.0);
}

TEST(StepEvaluatorTest, AStepIsDueOnlyAfterBothSidesWereVisibleForTwoMetres) {
  const TruthHeights heights = heightsOf([](double x, double y) { return kerb(x, y, 0.12); });
  std::vector<SeenPoint> low_side;
  for (const SeenPoint& point : allSeen()) {
    if (point.world_m.y() < 2.0F && point.world_m.x() < 20.0F) {
      low_side.push_back(point);
    }
  }
  EXPECT_EQ(judge(heights, 2.0, 0.0, low_side).high.num_due, 0U);
  StepEvaluator evaluator(heights);
  for (const double x : {1.0, 2.0, 2.9}) {
    evaluator.add(mapAt(x), allSeen(), RigidTransform::planar(x, 0.0, 0.0), {});
    EXPECT_EQ(evaluator.errors().high.num_due, 0U);
  }
  evaluator.add(mapAt(3.1), allSeen(), RigidTransform::planar(3.1, 0.0, 0.0), {});
  EXPECT_GT(evaluator.errors().high.num_due, 0U);
  EXPECT_EQ(evaluator.errors().high.num_found, 0U);
}

TEST(StepEvaluatorTest, NoReportNearAMoverIsFalse) {
  const TruthHeights heights = heightsOf([](double, double) { return 0.0; });
  EXPECT_EQ(judge(heights, -3.0, 0.0).num_false_steps, 1U);
  const TruthObstacle walkers{"pedestrian", {{0.0, -3.2}, {20.0, -3.2}, {20.0, -2.8}, {0.0, -2.8}}, 0.0, 1.8};
  EXPECT_EQ(judge(heights, -3.0, 0.0, allSeen(), {walkers}).num_false_steps, 0U);
}

}  // namespace
}  // namespace vcharge
