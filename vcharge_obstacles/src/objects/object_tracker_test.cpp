#include "vcharge_obstacles/object_tracker.h"

#include <cmath>
#include <memory>
#include <string>
#include <vector>

#include <gtest/gtest.h>

#include "objects/moving_world.h"
#include "vcharge_core/base/error.h"
#include "vcharge_core/files/content_hash.h"

namespace vcharge {
namespace {

constexpr double kHeight_m = 0.7, kPeriod_s = 0.08;

/// A straight drive at constant speed through a world, seen by the front camera.
std::vector<ObjectFrame> drive(const MovingWorld& world, double speed_m_per_s, double duration_s,
                               const ObjectTrackerOptions& options = {}) {
  std::vector<ObjectFrame> frames;
  const auto rig = std::make_shared<const CameraRig>(makeFrontRig(kHeight_m));
  ObjectTracker tracker(rig, options, [&](const ObjectFrame& frame) { frames.push_back(frame); });
  for (double time_s = 0.0; time_s <= duration_s; time_s += kPeriod_s) {
    const Timestamp stamp = Timestamp::fromNanoseconds(1'000'000'000) + durationFromSeconds(time_s);
    const RigidTransform pose = RigidTransform::planar(speed_m_per_s * time_s, 0.0, 0.0);
    tracker.addOdometry({stamp, pose, speed_m_per_s, 0.0});
    tracker.addImage(0, stamp, {world.render(rig->cameras[0], pose, time_s), nullptr});
  }
  tracker.finish();
  return frames;
}

/// Checks the only object of the last frames against a cylinder.
void expectFollowed(const std::vector<ObjectFrame>& frames, const UprightCylinder& truth, double from_s,
                    double position_m, double velocity_m_per_s) {
  size_t judged = 0, found = 0;
  for (const ObjectFrame& frame : frames) {
    const double time_s = toSeconds(frame.stamp - frames.front().stamp);
    if (time_s < from_s) {
      continue;
    }
    ++judged;
    for (const TrackedObject& object : frame.objects) {
      const Eigen::Vector2d position = object.frame_from_object.translation().head<2>();
      const Eigen::Vector2d velocity = object.velocity_m_per_s.head<2>();
      if ((position - truth.positionAt(time_s)).norm() < position_m &&
          (velocity - truth.velocity_m_per_s).norm() < velocity_m_per_s) {
        ++found;
        break;
      }
    }
    EXPECT_LE(frame.objects.size(), 1U) << time_s;
  }
  EXPECT_GE(static_cast<double>(found), 0.9 * static_cast<double>(judged)) << judged << " frames";
}

TEST(ObjectTrackerTest, StandingCarFollowsAPersonWhoCrosses) {
  MovingWorld world;
  world.cylinders = {{{8.0, -2.0}, {0.0, 1.2}}};
  expectFollowed(drive(world, 0.0, 2.4), world.cylinders[0], 0.6, 0.3, 0.3);
}

TEST(ObjectTrackerTest, StandingCarFollowsAPersonWhoApproaches) {
  MovingWorld world;
  world.cylinders = {{{9.0, 0.5}, {-1.2, 0.0}}};
  expectFollowed(drive(world, 0.0, 2.4), world.cylinders[0], 0.6, 0.35, 0.3);
}

TEST(ObjectTrackerTest, DrivingCarTellsAPersonWhoCrossesFromAPost) {
  MovingWorld world;
  world.cylinders = {{{10.0, -2.0}, {0.0, 1.2}}, {{8.0, 2.0}, {0.0, 0.0}, 0.15, 1.2}};
  expectFollowed(drive(world, 2.0, 2.0), world.cylinders[0], 0.6, 0.4, 0.35);
}

TEST(ObjectTrackerTest, DrivingCarFollowsAPersonWhoComesStraightAhead) {
  MovingWorld world;
  world.cylinders = {{{10.5, 0.2}, {-1.0, 0.0}}};
  expectFollowed(drive(world, 1.0, 3.0), world.cylinders[0], 2.4, 0.3, 0.3);
}

TEST(ObjectTrackerTest, NothingMovesInAStaticWorld) {
  MovingWorld world;
  world.cylinders = {{{7.0, 1.2}, {0.0, 0.0}, 0.15, 1.2}, {{9.0, -1.5}, {0.0, 0.0}, 0.4, 1.5}};
  for (const double speed_m_per_s : {0.0, 2.0}) {
    for (const ObjectFrame& frame : drive(world, speed_m_per_s, 2.0)) {
      EXPECT_TRUE(frame.objects.empty()) << speed_m_per_s;
    }
  }
}

TEST(ObjectTrackerTest, FramesWithoutAnObjectAreHandedOutToo) {
  EXPECT_EQ(drive(MovingWorld(), 1.0, 0.4).size(), 6U);
}

TEST(ObjectTrackerTest, SameDriveGivesSameObjects) {
  MovingWorld world;
  world.cylinders = {{{8.0, -2.0}, {0.0, 1.2}}};
  std::string hashes[2];
  for (std::string& hash : hashes) {
    ContentHasher hasher;
    for (const ObjectFrame& frame : drive(world, 1.0, 1.0)) {
      addToHash(frame, &hasher);
    }
    hash = hasher.hex();
  }
  EXPECT_EQ(hashes[0], hashes[1]);
}

TEST(ObjectTrackerTest, MissingExtrinsicsAndUnknownCamerasAreErrors) {
  CameraRig rig = makeFrontRig(kHeight_m);
  ObjectTrackerOptions options;
  options.cameras = {"roof"};
  const auto ignore = [](const ObjectFrame& /*frame*/) {};
  EXPECT_THROW(ObjectTracker(std::make_shared<const CameraRig>(rig), options, ignore), InputError);
  rig.cameras[0].vehicle_from_camera.reset();
  EXPECT_THROW(ObjectTracker(std::make_shared<const CameraRig>(rig), {}, ignore), InputError);
}

}  // namespace
}  // namespace vcharge
