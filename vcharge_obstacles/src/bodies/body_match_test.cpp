#include "bodies/body_match.h"

#include <optional>

#include <gtest/gtest.h>

#include "objects/moving_world.h"

namespace vcharge {
namespace {

constexpr double kHeight_m = 0.7;

/// The panoramas of a standing camera at two times, 0.08 s apart.
class BodyMatchTest : public testing::Test {
 protected:
  BodyBearing bearingAt(const Eigen::Vector2d& position_m) const {
    return bearingFrom(rig_.cameras[0].vehicle_from_camera->translation().head<2>(), position_m);
  }
  cv::Mat see(const UprightCylinder& person, double time_s) const {
    MovingWorld world;
    world.cylinders = {person};
    return panorama_.render(world.render(rig_.cameras[0], RigidTransform(), time_s));
  }
  const CameraRig rig_ = makeFrontRig(kHeight_m);
  const Panorama panorama_{rig_.cameras[0]};
};

TEST_F(BodyMatchTest, FindsHowFarAPersonHasGone) {
  for (const Eigen::Vector2d& velocity :
       {Eigen::Vector2d(0.0, 1.5), Eigen::Vector2d(0.0, -1.0), Eigen::Vector2d(-1.2, 0.6)}) {
    const UprightCylinder person{{8.0, 0.5}, velocity};
    const BodyBearing before = bearingAt(person.positionAt(0.0)), now = bearingAt(person.positionAt(0.08));
    // Expected where the person was, but at the right distance.
    const BodyBearing expected{before.azimuth_rad, now.range_m};
    const std::optional<BodyMatch> match =
        matchBody(panorama_, see(person, 0.0), see(person, 0.08), before, expected, kHeight_m, 1.7, 0.05);
    ASSERT_TRUE(match);
    EXPECT_NEAR(match->shift_rad, now.azimuth_rad - before.azimuth_rad, 0.5 * panorama_.pixel_rad());
    EXPECT_GT(match->correlation, 0.8);
  }
}

TEST_F(BodyMatchTest, NothingWithoutTextureOrOutsideOfTheView) {
  const cv::Mat gray(panorama_.validMask().size(), CV_8UC1, cv::Scalar(90));
  const BodyBearing ahead{0.0, 4.0}, behind{3.0, 4.0};
  EXPECT_FALSE(matchBody(panorama_, gray, gray, ahead, ahead, kHeight_m, 1.7, 0.05));
  const cv::Mat person = see({{8.0, 0.0}, {0.0, 0.0}}, 0.0);
  EXPECT_FALSE(matchBody(panorama_, person, person, behind, behind, kHeight_m, 1.7, 0.05));
}

TEST_F(BodyMatchTest, NothingWhereTheBestIsAtTheEndOfTheSearch) {
  const UprightCylinder person{{8.0, 0.0}, {0.0, 6.0}};
  const BodyBearing before = bearingAt(person.positionAt(0.0));
  const std::optional<BodyMatch> match =
      matchBody(panorama_, see(person, 0.0), see(person, 0.08), before, before, kHeight_m, 1.7, 0.01);
  EXPECT_TRUE(!match || match->correlation < 0.8);
}

}  // namespace
}  // namespace vcharge
