#include "vcharge_obstacles/obstacle_mapper.h"

#include <algorithm>
#include <cmath>
#include <functional>
#include <limits>

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <opencv2/imgproc.hpp>

#include "detection/box_world.h"
#include "vcharge_core/base/error.h"

namespace vcharge {
namespace {

constexpr double kSpeed_m_per_s = 1.25;  // 0.1 m per image
constexpr double kDegree = M_PI / 180.0;
const BoxWorld kWorld{{{{3.0, 2.5, 0.0}, {3.5, 3.0, 1.2}}}};

/// A drive along x, odometry at 50 Hz and range maps at 12.5 Hz, in which things go wrong.
class ObstacleMapperTest : public ::testing::Test {
 protected:
  void start() {
    frames_.clear();
    mapper_ = std::make_unique<ObstacleMapper>(
        rig_, options_, [this](const ObstacleFrame& frame) { frames_.push_back(frame); });
  }
  static Timestamp stampAt(int tick) { return Timestamp::fromNanoseconds(1000000000LL + 20000000LL * tick); }

  /// The true pose at a tick of 20 ms; tilted as the test says.
  RigidTransform poseAt(int tick) const {
    const double x = std::min(tick, stops_at_) * 0.02 * kSpeed_m_per_s;
    return RigidTransform(rotationFromYawPitchRoll(0.0, 0.0, roll_rad_), Eigen::Vector3d(x, 0.0, 0.0));
  }
  void drive(int from_tick, int to_tick) {
    for (int tick = from_tick; tick < to_tick; ++tick) {
      VehicleOdometry odometry;
      odometry.stamp = stampAt(tick);
      odometry.odom_from_vehicle = RigidTransform::planar(
          poseAt(tick).translation().x() + (tick >= jumps_at_ ? jump_m_ : 0.0), 0.0, 0.0);
      mapper_->addOdometry(odometry);
      if (tick % 4 != 0 || tick >= stops_at_) {
        continue;
      }
      for (const RigCamera& camera : rig_->cameras) {
        if (camera.name == dead_camera_ && tick >= dead_from_) {
          continue;
        }
        BoxWorldNoise noise{0.01, camera.name == blind_camera_ && tick >= dead_from_ ? 1.0 : 0.1,
                            static_cast<uint32_t>(tick)};
        mapper_->addRangeMap(measureBoxWorld(kWorld, camera, poseAt(tick), stampAt(tick), noise));
      }
    }
  }
  static int count(const ObstacleFrame& frame, int8_t state) {
    return cv::countNonZero(frame.map.state == state);
  }
  static int8_t stateAt(const ObstacleFrame& frame, double x_m, double y_m) {
    const Eigen::Vector2d cell = (Eigen::Vector2d(x_m, y_m) - frame.map.origin_m) / frame.map.cell_size_m;
    return frame.map.state.at<int8_t>(static_cast<int>(std::floor(cell.y())),
                                      static_cast<int>(std::floor(cell.x())));
  }
  /// Cells of a frame that were not free in the one before, and are now, on one side of the path.
  static int newlyFree(const ObstacleFrame& before, const ObstacleFrame& after, double min_y_m) {
    int newly = 0;
    for (int row = 0; row < after.map.state.rows; ++row) {
      for (int column = 0; column < after.map.state.cols; ++column) {
        const Eigen::Vector2d place =
            after.map.origin_m + after.map.cell_size_m * Eigen::Vector2d(column + 0.5, row + 0.5);
        const Eigen::Vector2d cell = (place - before.map.origin_m) / before.map.cell_size_m;
        const bool known_before = cell.x() >= 0 && cell.y() >= 0 && cell.x() < before.map.state.cols &&
                                  cell.y() < before.map.state.rows;
        const bool was_free =
            known_before &&
            before.map.state.at<int8_t>(static_cast<int>(cell.y()), static_cast<int>(cell.x())) == kCellFree;
        newly +=
            place.y() > min_y_m && !was_free && after.map.state.at<int8_t>(row, column) == kCellFree ? 1 : 0;
      }
    }
    return newly;
  }
  /// Front camera left out: it sees both sides, too.
  static std::shared_ptr<const CameraRig> makeSideRig() {
    CameraRig rig = makeBoxWorldRig();
    rig.cameras.erase(rig.cameras.begin());
    return std::make_shared<const CameraRig>(rig);
  }
  /// Within 1 m before and behind the side cameras, 3 m wide from there on.
  int countFreeBeside(double min_y_m) const {
    const double middle = frames_.back().map.fixed_from_vehicle.translation().x() + 1.9;
    int free = 0;
    for (double x = middle - 1.0; x < middle + 1.0; x += 0.1) {
      for (double y = min_y_m + 0.05; y < min_y_m + 3.0; y += 0.1) {
        free += stateAt(frames_.back(), x, y) == kCellFree ? 1 : 0;
      }
    }
    return free;
  }
  const ObstacleCameraStatus& statusOf(const std::string& camera) const {
    return *std::find_if(frames_.back().status.begin(), frames_.back().status.end(),
                         [&](const ObstacleCameraStatus& status) { return status.camera_name == camera; });
  }

  std::shared_ptr<const CameraRig> rig_ = std::make_shared<const CameraRig>(makeBoxWorldRig());
  ObstacleMapperOptions options_;
  std::unique_ptr<ObstacleMapper> mapper_;
  std::vector<ObstacleFrame> frames_;
  int stops_at_ = 100000, jumps_at_ = 100000, dead_from_ = 0;
  double jump_m_ = 0.0, roll_rad_ = 0.0;
  std::string dead_camera_, blind_camera_;
};

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

TEST_F(ObstacleMapperTest, OrderInWhichCamerasArriveDoesNotMatter) {
  const auto run = [&](bool reversed) {
    start();
    for (int tick = 0; tick < 24; ++tick) {
      VehicleOdometry odometry;
      odometry.stamp = stampAt(tick);
      odometry.odom_from_vehicle = poseAt(tick);
      mapper_->addOdometry(odometry);
      for (size_t i = 0; i < 3 && tick % 4 == 0; ++i) {
        const RigCamera& camera = rig_->cameras[reversed ? 2 - i : i];
        mapper_->addRangeMap(measureBoxWorld(kWorld, camera, poseAt(tick), stampAt(tick), {0.01, 0.1, 1}));
      }
    }
    mapper_->finish();
    ContentHasher hasher;
    addToHash(frames_.back().map, &hasher);
    return hasher.hex();
  };
  EXPECT_EQ(run(false), run(true));
}

TEST_F(ObstacleMapperTest, CameraThatStopsIsToldAndItsSideTurnsUnobserved) {
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

TEST_F(ObstacleMapperTest, GroundTiltedByThreeDegreesFreesNothingAndIsTold) {
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

TEST_F(ObstacleMapperTest, OdometryThatJumpsEmptiesTheMap) {
  start();
  drive(0, 40);
  const int before = count(frames_.back(), kCellFree);
  ASSERT_GT(before, 1000);
  jumps_at_ = 41;
  jump_m_ = 0.5;
  drive(40, 46);
  EXPECT_EQ(mapper_->numJumps(), 1U);
  mapper_->finish();
  // One look from the new place, no more.
  EXPECT_EQ(stateAt(frames_.back(), 3.25, 2.55), kCellUnobserved);
  EXPECT_LT(count(frames_.back(), kCellFree), before / 20);
}

TEST_F(ObstacleMapperTest, JumpPublishesTheEmptyMapAtOnce) {
  start();
  drive(0, 40);
  mapper_->finish();
  const size_t before = frames_.size();
  VehicleOdometry odometry;
  odometry.stamp = stampAt(41);
  odometry.odom_from_vehicle = RigidTransform::planar(3.0, 0.0, 0.0);
  mapper_->addOdometry(odometry);  // alone
  ASSERT_EQ(frames_.size(), before + 1);
  EXPECT_EQ(frames_.back().map.stamp, odometry.stamp);
  EXPECT_EQ(count(frames_.back(), kCellUnobserved),
            frames_.back().map.state.rows * frames_.back().map.state.cols);
  // A range map from before it has no place in the new map.
  mapper_->addRangeMap(measureBoxWorld(kWorld, rig_->cameras[1], poseAt(38), stampAt(39)));
  EXPECT_EQ(mapper_->status()[1].late, 1U);
}

TEST_F(ObstacleMapperTest, RangeMapsWithoutOdometryDoNotPileUp) {
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

TEST_F(ObstacleMapperTest, CameraThatNeverComesIsNotWaitedForWithoutEnd) {
  options_.frames.waitForEverything();  // as in a replay without loss
  dead_camera_ = "left";
  start();
  drive(0, 240);
  EXPECT_GE(frames_.size(), 60U - 26U);
  EXPECT_LE(mapper_->numWaiting(), 25U);
  EXPECT_GT(count(frames_.back(), kCellFree), 500);
}

TEST_F(ObstacleMapperTest, MapsDoNotDependOnHowLateRangeMapsCome) {
  const auto run = [&](int delay_ticks) {
    options_.frames.waitForEverything();
    start();
    std::map<Timestamp, std::string> hashes;
    for (int tick = 0; tick < 60 + delay_ticks; ++tick) {
      if (tick < 60) {
        VehicleOdometry odometry;
        odometry.stamp = stampAt(tick);
        odometry.odom_from_vehicle = poseAt(tick);
        mapper_->addOdometry(odometry);
      }
      const int seen = tick - delay_ticks;
      for (size_t i = 0; i < 3 && seen >= 0 && seen % 4 == 0; ++i) {
        mapper_->addRangeMap(
            measureBoxWorld(kWorld, rig_->cameras[i], poseAt(seen), stampAt(seen), {0.01, 0.1, 1}));
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

TEST_F(ObstacleMapperTest, RangeMapsThatLagAreNoSilence) {
  start();
  constexpr int kDelayTicks = 41;  // 0.8 s: longer than the waiting times
  for (int tick = 0; tick < 100; ++tick) {
    VehicleOdometry odometry;
    odometry.stamp = stampAt(tick);
    odometry.odom_from_vehicle = poseAt(tick);
    mapper_->addOdometry(odometry);
    const int seen = tick - kDelayTicks;
    for (size_t i = 0; i < 3 && seen >= 0 && seen % 4 == 0; ++i) {
      mapper_->addRangeMap(measureBoxWorld(kWorld, rig_->cameras[i], poseAt(seen), stampAt(seen)));
    }
  }
  ASSERT_EQ(frames_.size(), 15U);
  for (size_t i = 0; i < frames_.size(); ++i) {
    EXPECT_EQ(frames_[i].map.stamp, stampAt(4 * static_cast<int>(i)));
    EXPECT_EQ(frames_[i].cameras.size(), 3U);
  }
}

TEST_F(ObstacleMapperTest, StampsOfMapsGrowAndLateRangeMapsShowInTheNext) {
  start();
  drive(0, 40);
  const auto moveOn = [&](int from_tick, int to_tick) {
    for (int tick = from_tick; tick < to_tick; ++tick) {
      VehicleOdometry odometry;
      odometry.stamp = stampAt(tick);
      odometry.odom_from_vehicle = poseAt(tick);
      mapper_->addOdometry(odometry);
    }
  };
  moveOn(40, 100);
  ASSERT_TRUE(frames_.back().cameras.empty());  // of silence
  const ObstacleFrame silent = frames_.back();
  const size_t num_frames = frames_.size();
  for (int tick = 40; stampAt(tick) <= silent.map.stamp; tick += 4) {
    for (const RigCamera& camera : rig_->cameras) {
      mapper_->addRangeMap(measureBoxWorld(kWorld, camera, poseAt(tick), stampAt(tick)));
    }
  }
  EXPECT_EQ(frames_.size(), num_frames);
  moveOn(100, 105);
  for (const RigCamera& camera : rig_->cameras) {
    mapper_->addRangeMap(measureBoxWorld(kWorld, camera, poseAt(104), stampAt(104)));
  }
  ASSERT_EQ(frames_.size(), num_frames + 1);
  EXPECT_GT(newlyFree(silent, frames_.back(), -100.0), 1000);  // no cell becomes free by one look
  for (size_t i = 1; i < frames_.size(); ++i) {
    EXPECT_GT(frames_[i].map.stamp, frames_[i - 1].map.stamp);
  }
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

TEST_F(ObstacleMapperTest, BrakingIsNoJump) {
  start();
  stops_at_ = 40;  // from full speed to none within 20 ms
  drive(0, 60);
  EXPECT_EQ(mapper_->numJumps(), 0U);
}

TEST_F(ObstacleMapperTest, DriveThatBeginsAtSpeedIsNoJump) {
  start();
  for (int i = 0; i < 10; ++i) {  // as slow as the images, at 5 m/s
    VehicleOdometry odometry;
    odometry.stamp = stampAt(4 * i);
    odometry.odom_from_vehicle = RigidTransform::planar(0.4 * i, 0.0, 0.0);
    mapper_->addOdometry(odometry);
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

TEST_F(ObstacleMapperTest, StandingVehicleKeepsItsMapAndSaysSo) {
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

TEST_F(ObstacleMapperTest, RangeMapWithoutAPoseIsCountedNotPlaced) {
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

TEST_F(ObstacleMapperTest, CellsFollowTheMapFrame) {
  options_.fixed_frame = FixedFrame::kMap;
  start();
  drive(0, 40);
  mapper_->finish();
  EXPECT_TRUE(frames_.empty());  // without map -> odom there is no place
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
