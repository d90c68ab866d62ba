#include "liveness/silent_cameras.h"

#include <gmock/gmock.h>

#include "fusion/obstacle_mapper_fixture.h"

namespace vcharge {
namespace {

/// The fixture's drive, with images.
class SilentCamerasTest : public ObstacleMapperTest {
 protected:
  SilentCamerasTest() { notes_images_ = true; }
  /// Free cells of a frame that a camera sees, and that no other camera sees within its range.
  int countFreeOfOnly(const std::string& name, const ObstacleFrame& frame) const {
    const RigidTransform vehicle_from_fixed = frame.map.fixed_from_vehicle.inverse();
    int free = 0;
    for (int row = 0; row < frame.map.state.rows; ++row) {
      for (int column = 0; column < frame.map.state.cols; ++column) {
        const Eigen::Vector2d middle_m =
            frame.map.origin_m + frame.map.cell_size_m * Eigen::Vector2d(column + 0.5, row + 0.5);
        const Eigen::Vector2d point_m =
            (vehicle_from_fixed * Eigen::Vector3d(middle_m.x(), middle_m.y(), 0.0)).head<2>();
        bool only = true;
        for (const RigCamera& camera : rig_->cameras) {
          const double range_m = (point_m - camera.vehicle_from_camera->translation().head<2>()).norm();
          const bool sees =
              seesGround(camera, point_m) && (camera.name == name || range_m <= options_.map.free_range_m);
          only = only && sees == (camera.name == name);
        }
        free += only && frame.map.state.at<int8_t>(row, column) == kCellFree ? 1 : 0;
      }
    }
    return free;
  }
};

TEST_F(SilentCamerasTest, GroundIsSeenWithinTheFieldOfViewOnly) {
  const RigCamera& left = rig_->cameras[1];  // at (1.9, 0.98), looks to the left
  EXPECT_TRUE(seesGround(left, {1.9, 3.0}));
  EXPECT_TRUE(seesGround(left, {-1.0, 2.5}));
  EXPECT_FALSE(seesGround(left, {1.9, -3.0}));
  EXPECT_FALSE(seesGround(rig_->cameras[0], {1.0, 0.5}));  // behind the front camera
  RigCamera masked = left;
  masked.mask = cv::Mat(left.image_size_px, CV_8UC1, cv::Scalar(0));
  EXPECT_FALSE(seesGround(masked, {1.9, 3.0}));
}

TEST_F(SilentCamerasTest, DeadCameraLosesItsFreeGroundWithinThreeTenthsOfASecond) {
  rig_ = makeSideRig();
  start();
  drive(0, 40);
  const ObstacleFrame before = frames_.back();
  ASSERT_GT(countFreeOfOnly("left", before), 300);
  ASSERT_GT(countFreeOfOnly("right", before), 300);
  dead_camera_ = "left";
  dead_from_ = 40;  // the last image is at tick 36
  drive(40, 50);
  EXPECT_GT(countFreeOfOnly("left", frames_.back()), 100);  // it is silent from tick 51 on
  drive(50, 57);
  EXPECT_LE(frames_.back().map.stamp, stampAt(56));
  EXPECT_EQ(countFreeOfOnly("left", frames_.back()), 0);
  EXPECT_GT(countFreeOfOnly("right", frames_.back()), 300);
  EXPECT_EQ(statusOf("left").state, ObstacleCameraState::kSilent);
  EXPECT_THAT(statusOf("left").message, ::testing::HasSubstr("no image since " + toString(stampAt(36))));
  EXPECT_EQ(statusOf("right").state, ObstacleCameraState::kMapping);
}

TEST_F(SilentCamerasTest, OccupiedCellsStay) {
  start();
  drive(0, 41);
  ASSERT_EQ(stateAt(frames_.back(), 3.25, 2.55), kCellOccupied);
  const int occupied = count(frames_.back(), kCellOccupied);
  dead_camera_ = "left";
  dead_from_ = 44;
  stops_at_ = 44;
  drive(41, 100);
  EXPECT_EQ(statusOf("left").state, ObstacleCameraState::kSilent);
  EXPECT_EQ(stateAt(frames_.back(), 3.25, 2.55), kCellOccupied);
  EXPECT_GE(count(frames_.back(), kCellOccupied), occupied);
}

TEST_F(SilentCamerasTest, StandingCarWithLivingCamerasKeepsItsMap) {
  start();
  stops_at_ = 40;
  drive(0, 80);
  const ObstacleFrame stopped = frames_.back();
  drive(80, 260);
  EXPECT_EQ(cv::countNonZero(frames_.back().map.state != stopped.map.state), 0);
  EXPECT_EQ(statusOf("left").state, ObstacleCameraState::kStanding);
}

TEST_F(SilentCamerasTest, CameraThatDiesWhileTheCarStandsLosesItsGroundAtOnce) {
  start();
  stops_at_ = 40;
  drive(0, 120);
  ASSERT_GT(countFreeOfOnly("left", frames_.back()), 300);
  dead_camera_ = "left";
  dead_from_ = 120;  // the last image is at tick 116
  drive(120, 134);
  EXPECT_EQ(frames_.back().map.stamp, stampAt(116 + 15));  // 0.3 s later, without a range map
  EXPECT_EQ(countFreeOfOnly("left", frames_.back()), 0);
  EXPECT_GT(countFreeOfOnly("right", frames_.back()), 300);
  EXPECT_EQ(statusOf("left").state, ObstacleCameraState::kSilent);
}

TEST_F(SilentCamerasTest, GroundStaysUnknownAfterACameraOfAStandingCarHasRecovered) {
  start();
  stops_at_ = 40;
  drive(0, 120);
  dead_camera_ = "left";
  dead_from_ = 120;
  recovers_at_ = 160;
  drive(120, 260);
  EXPECT_EQ(statusOf("left").state, ObstacleCameraState::kStanding);
  EXPECT_EQ(countFreeOfOnly("left", frames_.back()), 0);  // who knows what has come meanwhile
  EXPECT_GT(countFreeOfOnly("right", frames_.back()), 300);
}

TEST_F(SilentCamerasTest, CameraThatHasRecoveredFreesGroundAgain) {
  rig_ = makeSideRig();
  start();
  drive(0, 40);
  dead_camera_ = "left";
  dead_from_ = 40;
  recovers_at_ = 80;
  drive(40, 81);
  EXPECT_LT(countFreeOfOnly("left", frames_.back()), 50);  // one observation frees no ground
  drive(81, 140);
  EXPECT_EQ(statusOf("left").state, ObstacleCameraState::kMapping);
  EXPECT_GT(countFreeOfOnly("left", frames_.back()), 300);
}

TEST_F(SilentCamerasTest, FrozenCameraCountsAsSilentAndItsRangeMapsAreIgnored) {
  rig_ = makeSideRig();
  start();
  drive(0, 40);
  frozen_camera_ = "left";
  dead_from_ = 40;  // the image at tick 40 is new, then it repeats
  drive(40, 45);
  EXPECT_EQ(frames_.back().cameras.size(), 1U);
  drive(45, 61);
  EXPECT_EQ(countFreeOfOnly("left", frames_.back()), 0);
  EXPECT_GT(countFreeOfOnly("right", frames_.back()), 300);
  EXPECT_EQ(statusOf("left").state, ObstacleCameraState::kFrozen);
  EXPECT_THAT(statusOf("left").message, ::testing::HasSubstr(toString(stampAt(40))));
}

TEST_F(SilentCamerasTest, FreeGroundDoesNotDependOnImagesThatAreDelivered) {
  const auto run = [&](bool notes_images) {
    notes_images_ = notes_images;
    start();
    drive(0, 100);
    ContentHasher hasher;
    for (const ObstacleFrame& frame : frames_) {
      addToHash(frame.map, &hasher);
    }
    return hasher.hex();
  };
  EXPECT_EQ(run(true), run(false));
}

TEST_F(SilentCamerasTest, ReplayForgetsTheSilence) {
  dead_camera_ = "left";
  dead_from_ = 40;
  start();
  drive(0, 80);
  ASSERT_EQ(statusOf("left").state, ObstacleCameraState::kSilent);
  drive(0, 36);
  EXPECT_EQ(statusOf("left").state, ObstacleCameraState::kMapping);
}

TEST_F(SilentCamerasTest, LateImagesAreReported) {
  start();
  for (int tick = 0; tick < 100; ++tick) {
    addOdometry(tick);
    if (tick % 4 == 0 && tick >= 8) {
      mapper_->noteImage(0, stampAt(tick - 1), static_cast<uint64_t>(tick));
      mapper_->noteImage(1, stampAt(tick - 5), static_cast<uint64_t>(tick));  // 0.1 s
    }
  }
  EXPECT_NEAR(mapper_->status()[0].image_lag_s, 0.02, 0.01);
  EXPECT_NEAR(mapper_->status()[1].image_lag_s, 0.1, 0.02);
  EXPECT_THAT(mapper_->status()[1].message, ::testing::HasSubstr("after their stamps"));
  EXPECT_THAT(mapper_->status()[0].message, ::testing::Not(::testing::HasSubstr("after their stamps")));
}

TEST_F(SilentCamerasTest, HostileImagesAreRefusedOrIgnored) {
  start();
  drive(0, 40);
  EXPECT_THROW(mapper_->noteImage(3, stampAt(40), 1), std::logic_error);
  mapper_->noteImage(1, stampAt(50 * 1000), 1);  // 1000 s ahead: a wrong clock
  mapper_->noteImage(1, Timestamp(), 2);
  drive(40, 80);
  EXPECT_EQ(statusOf("left").state, ObstacleCameraState::kMapping);
  options_.cameras = {"right"};
  start();
  EXPECT_NO_THROW(mapper_->noteImage(1, stampAt(40), 1));  // not in use
}

}  // namespace
}  // namespace vcharge
