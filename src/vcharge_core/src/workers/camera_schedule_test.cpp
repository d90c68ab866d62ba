#include "vcharge_core/workers/camera_schedule.h"

#include <cmath>

#include <gtest/gtest.h>

namespace vcharge {
namespace {

constexpr size_t kFront = 0, kLeft = 1, kRear = 2, kRight = 3, kNumCameras = 4;
const Eigen::Vector3d kStanding = Eigen::Vector3d::Zero();

/// Cameras in the middle of a car that look ahead, to the left, back and to the right.
CameraRig fourCameras() {
  CameraRig rig;
  for (size_t i = 0; i < kNumCameras; ++i) {
    const double yaw_rad = static_cast<double>(i) * M_PI / 2.0;
    Eigen::Matrix3d rotation;
    rotation.col(0) << std::sin(yaw_rad), -std::cos(yaw_rad), 0.0;
    rotation.col(1) << 0.0, 0.0, -1.0;
    rotation.col(2) << std::cos(yaw_rad), std::sin(yaw_rad), 0.0;
    rig.cameras.push_back({"camera" + std::to_string(i), "", cv::Size(640, 400),
                           PinholeCamera(PinholeCamera::Parameters::Constant(300.0)), M_PI, "", cv::Mat(),
                           RigidTransform(Eigen::Quaterniond(rotation), Eigen::Vector3d(0.0, 0.0, 1.0)),
                           std::nullopt});
  }
  return rig;
}

/// Numbers of turns in ten seconds at 12.5 Hz, if every turn takes `turn_s`.
std::vector<int> turnsOf(CameraSchedule* schedule, double turn_s, const Eigen::Vector3d& velocity,
                         std::vector<size_t>* per_stamp = nullptr, double passed_s = 0.001) {
  std::vector<int> turns(kNumCameras, 0);
  for (int i = 0; i < 125; ++i) {
    const std::vector<size_t> chosen = schedule->choose(Timestamp::fromSeconds(1.0 + 0.08 * i),
                                                        std::vector<bool>(kNumCameras, true), velocity);
    for (const size_t camera : chosen) {
      ++turns[camera];
      schedule->spend(turn_s, passed_s, 1);
    }
    if (per_stamp != nullptr) {
      per_stamp->push_back(chosen.size());
    }
  }
  return turns;
}

TEST(CameraScheduleTest, WithoutALimitAllCamerasHaveATurn) {
  CameraSchedule schedule(fourCameras(), 0.0);
  EXPECT_EQ(turnsOf(&schedule, 1.0, kStanding), std::vector<int>(kNumCameras, 125));
  EXPECT_FALSE(schedule.status().is_short);
}

TEST(CameraScheduleTest, TheBudgetIsHeldAndSharedEvenly) {
  CameraSchedule schedule(fourCameras(), 0.5);
  std::vector<size_t> per_stamp;
  const std::vector<int> turns = turnsOf(&schedule, 0.02, kStanding, &per_stamp);
  int sum = 0;
  for (const int each : turns) {
    EXPECT_NEAR(each, 62, 2);
    sum += each;
  }
  EXPECT_NEAR(0.02 * sum, 0.5 * 10.0, 0.2);
  for (size_t i = 20; i < per_stamp.size(); ++i) {
    EXPECT_NEAR(static_cast<double>(per_stamp[i]), 2.0, 1.0) << "even in time, too";
  }
  const CameraSchedule::Status status = schedule.status();
  EXPECT_TRUE(status.is_short);
  EXPECT_NEAR(status.used_s_per_s, 0.5, 0.1);
  EXPECT_EQ(status.left_out[kRear], 125U - static_cast<size_t>(turns[kRear]));
}

TEST(CameraScheduleTest, AnAmpleBudgetLeavesNothingOut) {
  CameraSchedule schedule(fourCameras(), 1.1);
  EXPECT_EQ(turnsOf(&schedule, 0.02, kStanding), std::vector<int>(kNumCameras, 125));
  EXPECT_FALSE(schedule.status().is_short);
}

TEST(CameraScheduleTest, CamerasThatLookWhereTheyAreGoingComeFirst) {
  CameraSchedule forward(fourCameras(), 0.5), reverse(fourCameras(), 0.5);
  const std::vector<int> ahead = turnsOf(&forward, 0.02, {2.0, 0.0, 0.0});
  EXPECT_GT(ahead[kFront], 1.4 * ahead[kRear]);
  EXPECT_GT(ahead[kRear], 40) << "but no camera is left out for long";
  const std::vector<int> back = turnsOf(&reverse, 0.02, {-2.0, 0.0, 0.0});
  EXPECT_GT(back[kRear], 1.4 * back[kFront]);
}

TEST(CameraScheduleTest, CamerasThatSeeSomethingMoveComeFirst) {
  CameraSchedule schedule(fourCameras(), 0.5);
  schedule.setObjects({{0.0, 4.0}});
  const std::vector<int> turns = turnsOf(&schedule, 0.02, kStanding);
  EXPECT_GT(turns[kLeft], 1.4 * turns[kRight]);
}

TEST(CameraScheduleTest, NoCameraIsLeftOutForGood) {
  CameraSchedule schedule(fourCameras(), 0.01);
  for (const int turns : turnsOf(&schedule, 0.2, {2.0, 0.0, 0.0})) {
    EXPECT_GE(turns, 4);
    EXPECT_LE(turns, 12);
  }
}

TEST(CameraScheduleTest, OverdrawnTimeIsPaidBack) {
  CameraSchedule schedule(fourCameras(), 0.5);
  turnsOf(&schedule, 0.02, kStanding);
  schedule.spend(0.5, 0.5, 0);
  const std::vector<bool> all(kNumCameras, true);
  EXPECT_TRUE(schedule.choose(Timestamp::fromSeconds(11.0), all, kStanding).empty());
  EXPECT_TRUE(schedule.choose(Timestamp::fromSeconds(11.2), all, kStanding).empty());
  EXPECT_FALSE(schedule.choose(Timestamp::fromSeconds(12.2), all, kStanding).empty());
}

TEST(CameraScheduleTest, TurnsEndBeforeTheNextStamp) {
  CameraSchedule schedule(fourCameras(), 2.0);
  std::vector<size_t> per_stamp;
  turnsOf(&schedule, 0.02, kStanding, &per_stamp, 0.03);
  EXPECT_EQ(per_stamp.back(), 2U) << "three take longer than 0.08 s, on a processor that is shared";
  turnsOf(&schedule, 0.02, kStanding, &per_stamp, 0.2);
  EXPECT_EQ(per_stamp.back(), 1U);
}

TEST(CameraScheduleTest, AReplayBeginsAnew) {
  CameraSchedule schedule(fourCameras(), 0.5);
  turnsOf(&schedule, 0.1, kStanding);
  EXPECT_FALSE(
      schedule.choose(Timestamp::fromSeconds(1.0), std::vector<bool>(kNumCameras, true), kStanding).empty());
  EXPECT_FALSE(schedule.status().is_short && schedule.status().used_s_per_s > 0.0);
}

TEST(CameraScheduleTest, ThreadProcessorTimePasses) {
  const double begin_s = threadProcessorTime_s();
  while (threadProcessorTime_s() < begin_s + 1e-3) {
  }
  EXPECT_GT(begin_s, 0.0);
}

TEST(CameraScheduleTest, DroppedStampsLeaveNoMoreTimeForTurns) {
  CameraSchedule schedule(fourCameras(), 2.0);
  std::vector<size_t> last;
  for (int i = 0; i < 100; ++i) {
    if (i % 10 < 8 && i % 2 == 1) {
      continue;  // dropped
    }
    const std::vector<bool> all(kNumCameras, true);
    last = schedule.choose(Timestamp::fromSeconds(1.0 + 0.08 * i), all, kStanding);
    for (size_t turn = 0; turn < last.size(); ++turn) {
      schedule.spend(0.02, 0.05, 1);
    }
  }
  EXPECT_EQ(last.size(), 1U);
}

TEST(CameraScheduleTest, TwoThreadsTakeTwiceAsManyTurns) {
  CameraSchedule schedule(fourCameras(), 2.0, 2);
  std::vector<size_t> per_stamp;
  turnsOf(&schedule, 0.02, kStanding, &per_stamp, 0.03);
  EXPECT_EQ(per_stamp.back(), 4U);
  turnsOf(&schedule, 0.02, kStanding, &per_stamp, 0.2);
  EXPECT_EQ(per_stamp.back(), 2U);
}

}  // namespace
}  // namespace vcharge
