#include "vcharge_obstacles/step_mapper.h"

#include <cmath>
#include <functional>
#include <random>
#include <stdexcept>

#include <gtest/gtest.h>

#include "detection/box_world.h"
#include "steps/near_heights.h"

namespace vcharge {
namespace {

constexpr VehicleOutline kOutline{3.75, -0.95, 0.95};
constexpr double kFrame_s = 0.08;

/// Height of the ground in the fixed frame.
using Ground = std::function<double(double x_m, double y_m)>;

/// Errors of the range maps of the test drive.
struct Noise {
  double height_sigma_m = 0.01;   // of a point
  double offset_sigma_m = 0.005;  // of the ground plane of a range map
  double slope_sigma = 0.002;
};

/// Points on the ground around the vehicle, three per cell on average, as a camera all around measures them.
HeightPoints measure(const Ground& ground, const RigidTransform& fixed_from_vehicle, const Noise& noise,
                     std::mt19937* random) {
  std::normal_distribution<double> normal;
  std::uniform_real_distribution<double> x(-4.0, 7.0), y(-4.0, 4.0);
  const double offset_m = noise.offset_sigma_m * normal(*random);
  const Eigen::Vector2d slope(noise.slope_sigma * normal(*random), noise.slope_sigma * normal(*random));
  HeightPoints points;
  for (int i = 0; i < 100000; ++i) {
    const Eigen::Vector2d at_m(x(*random), y(*random));
    if (at_m.x() < kOutline.front_m && at_m.x() > kOutline.rear_m &&
        std::abs(at_m.y()) < kOutline.half_width_m) {
      continue;
    }
    const Eigen::Vector3d fixed_m = fixed_from_vehicle * Eigen::Vector3d(at_m.x(), at_m.y(), 0.0);
    const double height_m = ground(fixed_m.x(), fixed_m.y()) + offset_m + slope.dot(at_m) +
                            noise.height_sigma_m * normal(*random);
    points.push_back({static_cast<float>(at_m.x()), static_cast<float>(at_m.y()),
                      static_cast<float>(height_m),
                      static_cast<float>(noise.height_sigma_m * noise.height_sigma_m)});
  }
  return points;
}

/// The map after the vehicle drove 1.6 m along x.
StepMap drive(const Ground& ground, const Noise& noise = {}, const StepMapperOptions& options = {}) {
  std::mt19937 random(7);
  StepMapper mapper(kOutline, options);
  for (int i = 0; i <= 10; ++i) {
    const RigidTransform pose = RigidTransform::planar(0.16 * i, 0.0, 0.0);
    mapper.moveTo(Timestamp() + durationFromSeconds(kFrame_s * i), pose);
    mapper.add(measure(ground, pose, noise, &random));
  }
  return mapper.snapshot();
}

float at(const StepMap& map, const cv::Mat& image, double x_m, double y_m) {
  return image.at<float>(static_cast<int>(std::floor((y_m - map.origin_m.y()) / map.cell_size_m)),
                         static_cast<int>(std::floor((x_m - map.origin_m.x()) / map.cell_size_m)));
}

int countSteps(const StepMap& map) {
  return cv::countNonZero(map.height_m > 0.0F);
}

/// Fraction of a line along x, at this y, with a step in the cell or in the next two aside.
double foundAlong(const StepMap& map, double from_m, double to_m, double y_m) {
  int found = 0, all = 0;
  for (double x_m = from_m + 0.025; x_m < to_m; x_m += 0.05) {
    bool is_found = false;
    for (const double aside_m : {-0.1, -0.05, 0.0, 0.05, 0.1}) {
      is_found = is_found || at(map, map.height_m, x_m, y_m + aside_m) > 0.0F;
    }
    found += is_found ? 1 : 0;
    ++all;
  }
  return static_cast<double>(found) / all;
}

Ground kerbAt(double y_m, double height_m) {
  return [=](double, double y) { return y > y_m ? height_m : 0.0; };
}

TEST(StepMapperTest, FindsAKerbOf8cmAlongItsLengthWithItsHeight) {
  const StepMap map = drive(kerbAt(2.0, 0.08));
  EXPECT_GE(foundAlong(map, 0.0, 5.0, 2.0), 0.95);
  EXPECT_NEAR(at(map, map.height_m, 2.0, 2.0), 0.08, 0.015);
  EXPECT_NEAR(at(map, map.ground_m, 2.0, 1.5), 0.0, 0.015);
  EXPECT_NEAR(at(map, map.ground_m, 2.0, 2.5) - at(map, map.ground_m, 2.0, 1.5), 0.08, 0.015);
  // Nothing away from the kerb.
  EXPECT_EQ(at(map, map.height_m, 2.0, 1.5), 0.0F);
  EXPECT_EQ(at(map, map.height_m, 2.0, -1.5), 0.0F);
}

TEST(StepMapperTest, FindsAStepOf5cmAndNotOneOf3cm) {
  EXPECT_GE(foundAlong(drive(kerbAt(2.0, 0.05)), 0.0, 5.0, 2.0), 0.8);
  EXPECT_LE(foundAlong(drive(kerbAt(2.0, 0.03)), 0.0, 5.0, 2.0), 0.05);
}

TEST(StepMapperTest, AStepIsMarkedWhereItIs) {
  // A kerb whose rise is spread over 10 cm, as by matching windows.
  const StepMap map = drive([](double, double y) { return 0.12 * std::clamp((y - 1.95) / 0.1, 0.0, 1.0); });
  EXPECT_GE(foundAlong(map, 0.0, 5.0, 2.0), 0.95);
  for (double x_m = 0.025; x_m < 5.0; x_m += 0.05) {
    EXPECT_EQ(at(map, map.height_m, x_m, 1.84), 0.0F) << x_m;
    EXPECT_EQ(at(map, map.height_m, x_m, 2.16), 0.0F) << x_m;
  }
}

TEST(StepMapperTest, FindsAHoleAndAStepDown) {
  const StepMap map = drive([](double x, double y) {
    const bool is_hole = x > 1.0 && x < 2.0 && y > -2.5 && y < -1.8;
    return is_hole ? -0.08 : y > 2.0 ? -0.06 : 0.0;
  });
  EXPECT_GE(foundAlong(map, 1.0, 2.0, -1.8), 0.95);
  EXPECT_GE(foundAlong(map, 1.0, 2.0, -2.5), 0.95);
  EXPECT_GE(foundAlong(map, 0.0, 5.0, 2.0), 0.8);
  EXPECT_LT(at(map, map.ground_m, 1.5, -2.15), -0.06F);
}

TEST(StepMapperTest, FindsAStepBehindAStripThatIsNotSeen) {
  std::mt19937 random(7);
  StepMapper mapper(kOutline);
  mapper.moveTo(Timestamp(), RigidTransform());
  for (int i = 0; i < 10; ++i) {
    HeightPoints seen;
    for (const HeightPoint& point : measure(kerbAt(2.0, -0.1), RigidTransform(), {}, &random)) {
      if (point.y_m < 2.0F || point.y_m > 2.1F) {
        seen.push_back(point);
      }
    }
    mapper.add(seen);
  }
  EXPECT_GE(foundAlong(mapper.snapshot(), 0.0, 3.0, 2.05), 0.95);
}

TEST(StepMapperTest, RampsAndBumpsAreDrivable) {
  // A bump of 8 cm with ramps of 0.4 m, a round one, and a ramp of 15 %.
  const Ground ground = [](double x, double y) {
    const double inside_m = std::min(0.9 - std::abs(x - 5.0), 0.95 - std::abs(y));
    const double flat_bump = 0.08 * std::clamp(inside_m / 0.4, 0.0, 1.0);
    const double round = std::abs(y - 2.0) < 0.6 ? 0.03 * (1.0 + std::cos(M_PI * (y - 2.0) / 0.6)) : 0.0;
    const double ramp = 0.15 * std::max(0.0, -1.5 - y);
    return flat_bump + round + ramp;
  };
  EXPECT_EQ(countSteps(drive(ground)), 0);
}

TEST(StepMapperTest, EvenGroundHasNoSteps) {
  const StepMap map = drive([](double, double) { return 0.0; }, {0.015, 0.01, 0.004});
  EXPECT_EQ(countSteps(map), 0);
  EXPECT_EQ(at(map, map.height_m, 2.0, 2.0), 0.0F);
  EXPECT_LT(at(map, map.sigma_m, 2.0, 2.0), 0.012F);
}

TEST(StepMapperTest, ReportsWhatTheOptionsAskFor) {
  StepMapperOptions options;
  options.min_step_m = 0.1;
  EXPECT_EQ(countSteps(drive(kerbAt(2.0, 0.05), {}, options)), 0);
  EXPECT_GE(foundAlong(drive(kerbAt(2.0, 0.12), {}, options), 0.0, 5.0, 2.0), 0.95);
  options = {};
  options.max_slope = 0.1;
  EXPECT_GT(countSteps(drive([](double, double y) { return 0.25 * std::max(0.0, y - 1.5); }, {}, options)),
            100);
  options.min_step_m = 0.0;
  EXPECT_THROW(StepMapper(kOutline, options), std::invalid_argument);
}

TEST(StepMapperTest, StandingKeepsTheMapAndUnseenGroundIsUnknown) {
  StepMapper mapper(kOutline);
  EXPECT_THROW(mapper.add({}), std::logic_error);
  mapper.moveTo(Timestamp(), RigidTransform());
  mapper.add({});
  EXPECT_TRUE(std::isnan(at(mapper.snapshot(), mapper.snapshot().height_m, 2.0, 2.0)));
  std::mt19937 random(7);
  for (int i = 0; i < 10; ++i) {
    mapper.add(measure(kerbAt(2.0, 0.1), RigidTransform(), {}, &random));
  }
  const StepMap before = mapper.snapshot();
  mapper.moveTo(Timestamp() + durationFromSeconds(100.0), RigidTransform());
  EXPECT_EQ(countSteps(mapper.snapshot()), countSteps(before));
  EXPECT_GT(countSteps(before), 50);
  // Whoever drives away forgets.
  mapper.moveTo(Timestamp() + durationFromSeconds(200.0), RigidTransform::planar(50.0, 0.0, 0.0));
  EXPECT_EQ(countSteps(mapper.snapshot()), 0);
}

TEST(StepMapperTest, StepsStayWhereTheyAreInACorrectedFrame) {
  std::mt19937 random(7);
  StepMapper mapper(kOutline);
  mapper.moveTo(Timestamp(), RigidTransform());
  for (int i = 0; i < 10; ++i) {
    mapper.add(measure(kerbAt(2.0, 0.1), RigidTransform(), {}, &random));
  }
  mapper.reanchor(RigidTransform::planar(10.0, 5.0, 0.5 * M_PI));
  const StepMap map = mapper.snapshot();
  EXPECT_NEAR(map.fixed_from_vehicle.translation().x(), 10.0, 1e-9);
  EXPECT_GT(at(map, map.height_m, 8.0, 6.0), 0.05F);  // (1, 2) before
  EXPECT_EQ(at(map, map.height_m, 8.5, 6.0), 0.0F);
}

TEST(NearHeightsTest, AreTheHeightsOfAKerbAboveATiltedPlane) {
  const CameraRig rig = makeBoxWorldRig();
  const RigCamera& left = rig.cameras[1];
  const BoxWorld world{{{{-10.0, 2.0, 0.0}, {10.0, 3.0, 0.1}}}};
  const RangeMap map = measureBoxWorld(world, left, RigidTransform(), Timestamp());
  const NearHeights finder(rebuildWorkingCamera(map.camera, map.range_m.size(), left),
                           *left.vehicle_from_camera, kOutline, 1.5);
  GroundPlane plane;
  EXPECT_TRUE(finder.find(map, plane).empty());  // not measured
  plane.state = GroundState::kMeasured;
  plane.offset_m = 0.02;
  plane.slope = {0.01, -0.02};
  int low = 0, high = 0;
  for (const HeightPoint& point : finder.find(map, plane)) {
    const double z_m = point.height_m + 0.02 + 0.01 * point.x_m - 0.02 * point.y_m;
    EXPECT_LE(point.y_m, 2.45F);
    EXPECT_TRUE(point.y_m >= 0.95F || point.x_m >= 3.75F || point.x_m <= -0.95F);
    if (point.y_m < 1.99F) {
      EXPECT_NEAR(z_m, 0.0, 1e-4);
      ++low;
    } else if (point.y_m > 2.01F) {
      EXPECT_NEAR(z_m, 0.1, 1e-4);
      ++high;
    }
  }
  EXPECT_GT(low, 500);
  EXPECT_GT(high, 100);
}

TEST(NearHeightsTest, ADarkCameraGivesNone) {
  const CameraRig rig = makeBoxWorldRig();
  RangeMap map = measureBoxWorld({}, rig.cameras[1], RigidTransform(), Timestamp());
  const NearHeights finder(rebuildWorkingCamera(map.camera, map.range_m.size(), rig.cameras[1]),
                           *rig.cameras[1].vehicle_from_camera, kOutline, 4.0);
  GroundPlane plane;
  plane.state = GroundState::kMeasured;
  EXPECT_FALSE(finder.find(map, plane).empty());
  map.range_m.setTo(NAN);
  map.standard_deviation_m.setTo(NAN);
  EXPECT_TRUE(finder.find(map, plane).empty());
  map.range_m = map.range_m.rowRange(0, 10);
  EXPECT_THROW(finder.find(map, plane), std::logic_error);
}

}  // namespace
}  // namespace vcharge
