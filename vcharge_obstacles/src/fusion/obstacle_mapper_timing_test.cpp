#include <limits>
#include <map>

#include "fusion/obstacle_mapper_fixture.h"

namespace vcharge {
namespace {

TEST_F(ObstacleMapperTest, ResultDoesNotDependOnTheOrderOfCameras) {
  const auto run = [&](bool reversed) {
    start();
    for (int tick = 0; tick < 24; ++tick) {
      addOdometry(tick);
      for (size_t i = 0; i < 3 && tick % 4 == 0; ++i) {
        mapper_->addRangeMap(measure(reversed ? 2 - i : i, tick, {0.01, 0.1, 1}));
      }
    }
    mapper_->finish();
    ContentHasher hasher;
    addToHash(frames_.back().map, &hasher);
    return hasher.hex();
  };
  EXPECT_EQ(run(false), run(true));
}

TEST_F(ObstacleMapperTest, JumpOfTheOdometryEmptiesTheMap) {
  start();
  drive(0, 40);
  const int before = count(frames_.back(), kCellFree);
  ASSERT_GT(before, 1000);
  jumps_at_ = 41;
  jump_m_ = 0.5;
  drive(40, 46);
  EXPECT_EQ(mapper_->numJumps(), 1U);
  mapper_->finish();
  // The map holds a single observation after the jump.
  EXPECT_EQ(stateAt(frames_.back(), 3.25, 2.55), kCellUnobserved);
  EXPECT_LT(count(frames_.back(), kCellFree), before / 20);
}

TEST_F(ObstacleMapperTest, JumpPublishesTheEmptyMapAtOnce) {
  start();
  drive(0, 40);
  mapper_->finish();
  const size_t before = frames_.size();
  addOdometry(41, 3.0);  // without range maps
  ASSERT_EQ(frames_.size(), before + 1);
  EXPECT_EQ(frames_.back().map.stamp, stampAt(41));
  EXPECT_EQ(count(frames_.back(), kCellUnobserved),
            frames_.back().map.state.rows * frames_.back().map.state.cols);
  // A range map from before the jump is ignored.
  mapper_->addRangeMap(measureBoxWorld(kWorld, rig_->cameras[1], poseAt(38), stampAt(39)));
  EXPECT_EQ(mapper_->status()[1].late, 1U);
}

TEST_F(ObstacleMapperTest, RangeMapsWithoutOdometryAreBounded) {
  start();
  drive(0, 20);
  mapper_->finish();
  constexpr int kMaps = 60;
  for (int i = 0; i < kMaps; ++i) {
    mapper_->addRangeMap(measureBoxWorld(kWorld, rig_->cameras[1], poseAt(20), stampAt(20 + 4 * i)));
  }
  EXPECT_LE(mapper_->numWaiting(), 25U);
  EXPECT_EQ(mapper_->status()[1].without_pose + mapper_->numWaiting(), static_cast<size_t>(kMaps));
  EXPECT_EQ(mapper_->status()[1].state, ObstacleCameraState::kNoPose);
}

TEST_F(ObstacleMapperTest, WaitingForAMissingCameraEnds) {
  options_.frames.waitForEverything();  // as in a lossless replay
  dead_camera_ = "left";
  start();
  drive(0, 240);
  EXPECT_GE(frames_.size(), 60U - 26U);
  EXPECT_LE(mapper_->numWaiting(), 25U);
  EXPECT_GT(count(frames_.back(), kCellFree), 500);
}

TEST_F(ObstacleMapperTest, MapsDoNotDependOnTheLagOfRangeMaps) {
  const auto run = [&](int delay_ticks) {
    options_.frames.waitForEverything();
    start();
    std::map<Timestamp, std::string> hashes;
    for (int tick = 0; tick < 60 + delay_ticks; ++tick) {
      if (tick < 60) {
        addOdometry(tick);
      }
      if (tick >= delay_ticks && (tick - delay_ticks) % 4 == 0) {
        addRangeMaps(tick - delay_ticks, {0.01, 0.1, 1});
      }
    }
    for (const ObstacleFrame& frame : frames_) {
      ContentHasher hasher;
      addToHash(frame.map, &hasher);
      EXPECT_FALSE(frame.cameras.empty());
      hashes[frame.map.stamp] = hasher.hex();
    }
    return hashes;
  };
  const auto expected = run(0);
  EXPECT_EQ(expected.size(), 15U);
  EXPECT_EQ(run(41), expected);  // 0.8 s
}

TEST_F(ObstacleMapperTest, LagOfRangeMapsIsNoSilence) {
  start();
  constexpr int kDelayTicks = 41;  // 0.8 s: longer than the waiting times
  for (int tick = 0; tick < 100; ++tick) {
    addOdometry(tick);
    if (tick >= kDelayTicks && (tick - kDelayTicks) % 4 == 0) {
      addRangeMaps(tick - kDelayTicks);
    }
  }
  ASSERT_EQ(frames_.size(), 15U);
  for (size_t i = 0; i < frames_.size(); ++i) {
    EXPECT_EQ(frames_[i].map.stamp, stampAt(4 * static_cast<int>(i)));
    EXPECT_EQ(frames_[i].cameras.size(), 3U);
  }
}

TEST_F(ObstacleMapperTest, StampsIncreaseAndLateRangeMapsAreInTheNextMap) {
  start();
  drive(0, 40);
  const auto moveOn = [&](int from_tick, int to_tick) {
    for (int tick = from_tick; tick < to_tick; ++tick) {
      addOdometry(tick);
    }
  };
  moveOn(40, 100);
  ASSERT_TRUE(frames_.back().cameras.empty());  // emitted during the silence
  const ObstacleFrame silent = frames_.back();
  const size_t num_frames = frames_.size();
  for (int tick = 40; stampAt(tick) <= silent.map.stamp; tick += 4) {
    addRangeMaps(tick);
  }
  EXPECT_EQ(frames_.size(), num_frames);
  moveOn(100, 105);
  addRangeMaps(104);
  ASSERT_EQ(frames_.size(), num_frames + 1);
  EXPECT_GT(newlyFree(silent, frames_.back(), -100.0), 1000);  // one observation alone frees no cell
  for (size_t i = 1; i < frames_.size(); ++i) {
    EXPECT_GT(frames_[i].map.stamp, frames_[i - 1].map.stamp);
  }
}

TEST_F(ObstacleMapperTest, BrakingIsNoJump) {
  start();
  stops_at_ = 40;  // from full speed to zero within 20 ms
  drive(0, 60);
  EXPECT_EQ(mapper_->numJumps(), 0U);
}

TEST_F(ObstacleMapperTest, StartAtSpeedIsNoJump) {
  start();
  for (int i = 0; i < 10; ++i) {  // at the images' rate, at 5 m/s
    addOdometry(4 * i, 0.4 * i);
  }
  EXPECT_EQ(mapper_->numJumps(), 0U);
}

TEST_F(ObstacleMapperTest, GapInTheOdometryEmptiesTheMap) {
  start();
  drive(0, 40);
  const int before = count(frames_.back(), kCellFree);
  ASSERT_GT(before, 1000);
  drive(80, 84);
  mapper_->finish();
  EXPECT_EQ(mapper_->numJumps(), 1U);
  EXPECT_LT(count(frames_.back(), kCellFree), before / 20);
}

TEST_F(ObstacleMapperTest, RangeMapWithoutAPoseIsCountedAndIgnored) {
  start();
  drive(0, 20);
  const RangeMap late = measureBoxWorld(kWorld, rig_->cameras[1], {}, stampAt(4));
  mapper_->addRangeMap(late);
  EXPECT_EQ(mapper_->status()[1].late, 1U);
  ObstacleMapper fresh(rig_, options_, [](const ObstacleFrame&) { FAIL() << "there is no pose"; });
  fresh.addRangeMap(late);
  fresh.finish();
  EXPECT_EQ(fresh.status()[1].without_pose, 1U);
}

}  // namespace
}  // namespace vcharge
