#include <gmock/gmock.h>
#include <opencv2/imgproc.hpp>

#include "fusion/obstacle_mapper_fixture.h"
#include "vcharge_core/base/error.h"

namespace vcharge {
namespace {

TEST_F(ObstacleMapperTest, OneMapPerStampFromAllCameras) {
  start();
  drive(0, 41);
  mapper_->finish();
  ASSERT_EQ(frames_.size(), 11U);
  EXPECT_EQ(frames_.back().cameras.size(), 3U);
  EXPECT_EQ(frames_.back().map.frame_id, "odom");
  EXPECT_EQ(stateAt(frames_.back(), 3.25, 2.55), kCellOccupied);
  EXPECT_EQ(statusOf("left").state, ObstacleCameraState::kMapping);
}

TEST_F(ObstacleMapperTest, StoppedCameraIsReportedAndItsSideTurnsUnobserved) {
  rig_ = makeSideRig();
  start();
  drive(0, 40);
  ASSERT_GT(countFreeBeside(1.0), 300);
  ASSERT_GT(countFreeBeside(-4.0), 300);
  dead_camera_ = "left";
  dead_from_ = 40;
  const ObstacleFrame before = frames_.back();
  drive(40, 240);
  EXPECT_EQ(statusOf("left").state, ObstacleCameraState::kNoRangeMaps);
  EXPECT_THAT(statusOf("left").message, ::testing::HasSubstr("no range map since"));
  EXPECT_EQ(statusOf("right").state, ObstacleCameraState::kMapping);
  EXPECT_EQ(countFreeBeside(1.0), 0);
  EXPECT_GT(countFreeBeside(-4.0), 300);
  EXPECT_EQ(newlyFree(before, frames_.back(), 0.0), 0);
}

TEST_F(ObstacleMapperTest, NightTurnsASideUnobservedAndFreesNothing) {
  rig_ = makeSideRig();
  start();
  drive(0, 40);
  blind_camera_ = "left";
  dead_from_ = 40;
  for (int tick = 40; tick < 240; tick += 4) {
    const ObstacleFrame before = frames_.back();
    drive(tick, tick + 4);
    EXPECT_EQ(newlyFree(before, frames_.back(), 1.0), 0);
  }
  EXPECT_EQ(statusOf("left").state, ObstacleCameraState::kHardlySees);
  EXPECT_EQ(countFreeBeside(1.0), 0);
}

TEST_F(ObstacleMapperTest, GroundTiltedByThreeDegreesIsReportedAndFreesNothing) {
  start();
  drive(0, 40);
  roll_rad_ = 3.0 * kDegree;
  for (int tick = 40; tick < 80; tick += 4) {
    const ObstacleFrame before = frames_.back();
    drive(tick, tick + 4);
    if (tick > 40) {
      EXPECT_EQ(newlyFree(before, frames_.back(), -100.0), 0);
    }
  }
  EXPECT_EQ(statusOf("left").state, ObstacleCameraState::kGroundLost);
  EXPECT_THAT(statusOf("left").message, ::testing::HasSubstr("tilted"));
}

TEST_F(ObstacleMapperTest, RangeMapsMayChangeTheirSize) {
  start();
  drive(0, 40);
  RigCamera half = rig_->cameras[1];
  RangeMap map = measureBoxWorld(kWorld, half, poseAt(40), stampAt(40));
  WorkingCameraOptions working;
  working.image_scale = 0.5 * map.range_m.cols / half.image_size_px.width;
  const WorkingCamera small(half.model, half.image_size_px, half.field_of_view_rad, half.mask, working);
  map.camera = small.model();
  for (cv::Mat* image : {&map.range_m, &map.standard_deviation_m, &map.confidence}) {
    cv::Mat smaller;
    cv::resize(*image, smaller, small.size(), 0.0, 0.0, cv::INTER_NEAREST);
    *image = smaller;
  }
  EXPECT_NO_THROW(mapper_->addRangeMap(map));
}

TEST_F(ObstacleMapperTest, StandingIsReportedAndKeepsTheMap) {
  start();
  stops_at_ = 40;
  drive(0, 80);
  const ObstacleFrame stopped = frames_.back();
  ASSERT_TRUE(stopped.cameras.empty());
  drive(80, 260);
  ASSERT_GT(frames_.size(), 5U);
  EXPECT_TRUE(frames_.back().cameras.empty());
  ASSERT_GT(count(stopped, kCellFree), 1000);
  EXPECT_EQ(cv::countNonZero(frames_.back().map.state != stopped.map.state), 0);
  EXPECT_EQ(stateAt(frames_.back(), 3.25, 2.55), kCellOccupied);
  EXPECT_EQ(statusOf("left").state, ObstacleCameraState::kStanding);
  double youngest = 0.0;
  cv::minMaxLoc(frames_.back().map.age_s, &youngest, nullptr, nullptr, nullptr,
                frames_.back().map.age_s == frames_.back().map.age_s);
  EXPECT_GT(youngest, 3.0);
}

TEST_F(ObstacleMapperTest, CellsFollowTheMapFrame) {
  options_.fixed_frame = FixedFrame::kMap;
  start();
  drive(0, 40);
  mapper_->finish();
  EXPECT_TRUE(frames_.empty());  // without map -> odom there is no pose
  start();
  mapper_->setMapFromOdom(RigidTransform::planar(10.0, 5.0, 0.0));
  drive(0, 40);
  EXPECT_EQ(frames_.back().map.frame_id, "map");
  EXPECT_EQ(stateAt(frames_.back(), 13.25, 7.55), kCellOccupied);
  mapper_->setMapFromOdom(RigidTransform::planar(10.3, 5.0, 0.0));
  drive(40, 44);
  mapper_->finish();
  EXPECT_EQ(stateAt(frames_.back(), 13.55, 7.55), kCellOccupied);
}

TEST_F(ObstacleMapperTest, RangeMapOfAnotherRigIsRefusedByName) {
  start();
  RangeMap map = measureBoxWorld(kWorld, rig_->cameras[1], {}, stampAt(0));
  map.camera = MeiCamera(1.15, 200.0, 224.0, 159.5, 99.5);
  try {
    mapper_->addRangeMap(map);
    ADD_FAILURE();
  } catch (const InputError& error) {
    EXPECT_THAT(error.what(), ::testing::HasSubstr("left"));
  }
  map.camera_name = "roof";
  EXPECT_THROW(mapper_->addRangeMap(map), InputError);
}

TEST_F(ObstacleMapperTest, RigWithoutExtrinsicsIsRefused) {
  CameraRig rig = makeBoxWorldRig();
  rig.cameras[2].vehicle_from_camera.reset();
  EXPECT_THROW(ObstacleMapper(std::make_shared<const CameraRig>(rig), options_, {}), InputError);
}

}  // namespace
}  // namespace vcharge
