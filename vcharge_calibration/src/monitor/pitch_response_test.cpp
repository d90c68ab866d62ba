#include "vcharge_calibration/monitor/pitch_response.h"

#include <random>

#include <gtest/gtest.h>

namespace vcharge {
namespace {

constexpr double kPeriod_s = 0.4;
constexpr double kRoad_rad = 0.001;

/// A vehicle that speeds up and brakes by turns on a slope.
std::vector<Keyframe> drive(double rad_per_m_per_s2, uint32_t seed, int num_keyframes = 60) {
  std::mt19937 random(seed);
  std::normal_distribution<double> road(0.0, kRoad_rad);
  std::vector<Keyframe> keyframes;
  double x_m = 0.0, speed_m_per_s = 1.5;
  for (int i = 0; i < num_keyframes; ++i) {
    const double acceleration = 0.4 * std::sin(0.7 * i);
    Keyframe keyframe;
    keyframe.stamp = Timestamp::fromNanoseconds(1'000'000'000 + static_cast<int64_t>(1e9 * kPeriod_s) * i);
    keyframe.travelled_m = x_m;
    const double nose_up_rad = 0.03 + 0.002 * x_m + rad_per_m_per_s2 * acceleration + road(random);
    keyframe.map_from_vehicle = RigidTransform(rotationFromYawPitchRoll(1.0, -nose_up_rad, 0.0),
                                               {x_m * std::cos(1.0), x_m * std::sin(1.0), 0.0});
    keyframes.push_back(keyframe);
    x_m += (speed_m_per_s + 0.5 * acceleration * kPeriod_s) * kPeriod_s;
    speed_m_per_s += acceleration * kPeriod_s;
  }
  return keyframes;
}

TEST(PitchResponseTest, IsThatOfTheBody) {
  for (const double truth : {0.0, 0.0045, 0.0225}) {
    PitchResponse response;
    for (uint32_t seed = 1; seed <= 4; ++seed) {
      PitchResponse part;
      part.add(drive(truth, seed));
      response += part;
    }
    EXPECT_NEAR(response.radPerMetrePerS2(), truth, 0.15 * truth + 4.0 * response.sigma());
    EXPECT_LT(response.sigma(), 0.001);
    EXPECT_EQ(response.isSoft(), truth > 0.01);
  }
}

TEST(PitchResponseTest, LittleIsNotBelieved) {
  PitchResponse response;
  EXPECT_TRUE(std::isinf(response.sigma()));
  response.add({});
  response.add(drive(0.0225, 1, 5));
  EXPECT_TRUE(std::isinf(response.sigma()));
  EXPECT_FALSE(response.isSoft());
}

TEST(PitchResponseTest, AStopIsNoAcceleration) {
  std::vector<Keyframe> keyframes = drive(0.0, 1);
  for (size_t i = 30; i < keyframes.size(); ++i) {
    keyframes[i].stamp = keyframes[i].stamp + durationFromSeconds(20.0);
  }
  PitchResponse response;
  response.add(keyframes);
  EXPECT_FALSE(response.isSoft());
  EXPECT_LT(response.sigma(), 0.002);
}

}  // namespace
}  // namespace vcharge
