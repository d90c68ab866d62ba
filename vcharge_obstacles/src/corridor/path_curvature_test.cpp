#include "corridor/path_curvature.h"

#include <cmath>

#include <gtest/gtest.h>

namespace vcharge {
namespace {

Timestamp stampAt(double time_s) {
  return Timestamp() + durationFromSeconds(100.0 + time_s);
}

/// Pose after a signed travel along an arc.
RigidTransform onArc(double curvature_per_m, double travel_m) {
  const double yaw_rad = curvature_per_m * travel_m;
  return curvature_per_m == 0.0
             ? RigidTransform::planar(travel_m, 0.0, 0.0)
             : RigidTransform::planar(std::sin(yaw_rad) / curvature_per_m,
                                      (1.0 - std::cos(yaw_rad)) / curvature_per_m, yaw_rad);
}

/// Poses of a travel as a function of time; known from the beginning of the drive on.
PathCurvature::PoseAt posesOf(double curvature_per_m, const std::function<double(double)>& travel_m) {
  return [=](Timestamp stamp) -> std::optional<RigidTransform> {
    const double time_s = toSeconds(stamp - stampAt(0.0));
    return time_s < 0.0 ? std::nullopt
                        : std::optional<RigidTransform>(onArc(curvature_per_m, travel_m(time_s)));
  };
}

TEST(PathCurvatureTest, ArcsHaveTheirCurvatureInBothDirections) {
  for (const double curvature_per_m : {-0.2, -0.01, 0.0, 0.05, 0.2}) {
    for (const double speed_m_per_s : {-1.0, 0.2, 5.0}) {
      PathCurvature curvature;
      EXPECT_NEAR(curvature.update(stampAt(4.0),
                                   posesOf(curvature_per_m, [&](double t) { return speed_m_per_s * t; })),
                  curvature_per_m, 1e-9)
          << speed_m_per_s;
    }
  }
}

TEST(PathCurvatureTest, StandingKeepsTheLastCurvature) {
  PathCurvature curvature;
  const auto stops = posesOf(0.1, [](double t) { return std::min(t, 2.0); });
  EXPECT_EQ(curvature.update(stampAt(0.1), stops), 0.0);  // too short a path
  EXPECT_NEAR(curvature.update(stampAt(2.0), stops), 0.1, 1e-9);
  EXPECT_NEAR(curvature.update(stampAt(20.0), stops), 0.1, 1e-9);
  curvature.clear();
  EXPECT_EQ(curvature.update(stampAt(20.0), stops), 0.0);
}

TEST(PathCurvatureTest, PathBeforeAChangeOfDirectionIsNotUsed) {
  // Forward to the left for 2 s, then backward with the wheels to the right.
  const auto poses = [](Timestamp stamp) -> std::optional<RigidTransform> {
    const double time_s = toSeconds(stamp - stampAt(0.0));
    if (time_s < 2.0) {
      return onArc(0.1, time_s);
    }
    return onArc(0.1, 2.0) * onArc(-0.15, -(time_s - 2.0));
  };
  PathCurvature curvature;
  EXPECT_NEAR(curvature.update(stampAt(2.0), poses), 0.1, 1e-9);
  EXPECT_NEAR(curvature.update(stampAt(2.1), poses), 0.1, 1e-9);  // 0.1 m say nothing yet
  EXPECT_NEAR(curvature.update(stampAt(2.3), poses), -0.15, 1e-9);
}

TEST(PathCurvatureTest, UnknownPosesKeepTheLastCurvature) {
  PathCurvature curvature;
  EXPECT_EQ(curvature.update(stampAt(-1.0), posesOf(0.1, [](double t) { return t; })), 0.0);
}

}  // namespace
}  // namespace vcharge
