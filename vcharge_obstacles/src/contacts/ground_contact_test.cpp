#include "contacts/ground_contact.h"

#include <gtest/gtest.h>

#include "objects/moving_world.h"

namespace vcharge {
namespace {

/// Part of the labelled pixels that show the ground after 0.4 m of driving, of a camera that is `height_m`
/// above a ground which seems to lie `seen_m` below it.
double groundPart(double height_m, double seen_m, bool is_mirror) {
  const CameraRig rig = makeFrontRig(height_m), seen = makeFrontRig(seen_m);
  const RigCamera& camera = rig.cameras.front();
  const WorkingCamera working(camera.model, camera.image_size_px, camera.field_of_view_rad, camera.mask, {});
  GroundContact contact(working, *camera.vehicle_from_camera, 12.0);
  const RigidTransform now = RigidTransform::planar(0.4, 0.0, 0.0);
  const auto view = [&](const RigidTransform& pose) {
    return working.undistort(MovingWorld().render(seen.cameras.front(), pose, 0.0));
  };
  contact.compare(view(now), view(RigidTransform()), now, is_mirror);
  return static_cast<double>(cv::countNonZero(contact.labels() == 1)) /
         cv::countNonZero(contact.labels() != 0);
}

TEST(GroundContactTest, GroundIsGround) {
  EXPECT_GT(groundPart(0.6, 0.6, false), 0.9);
  EXPECT_GT(groundPart(0.6, 0.6, true), 0.9);
}

TEST(GroundContactTest, WhatIsDeeperThanTheGroundIsGroundOnlyIfThatMirrors) {
  EXPECT_LT(groundPart(0.6, 0.9, false), 0.6);
  EXPECT_GT(groundPart(0.6, 0.9, true), 0.9);
}

TEST(GroundContactTest, WhatIsHigherThanTheGroundIsNoReflection) {
  EXPECT_LT(groundPart(0.9, 0.45, true), 0.6);
}

}  // namespace
}  // namespace vcharge
