#include "vcharge_calibration/live/rig_calibration_session.h"

#include <atomic>
#include <chrono>
#include <functional>
#include <future>
#include <memory>
#include <stdexcept>
#include <string>
#include <thread>
#include <vector>

#include <gtest/gtest.h>

#include "vcharge_core/base/error.h"

namespace vcharge {
namespace {

using Phase = RigCalibrationSession::Phase;

std::shared_ptr<const CameraRig> oneCamera() {
  CameraRig rig;
  rig.cameras = {{"front",
                  "camera_front_optical",
                  {320, 200},
                  MeiCamera(1.0, 200.0, 200.0, 160.0, 100.0),
                  3.0,
                  "",
                  {},
                  {},
                  {}}};
  return std::make_shared<const CameraRig>(rig);
}

/// A session without images; its calibrations fail at once.
class RigCalibrationSessionTest : public testing::Test {
 protected:
  std::unique_ptr<RigCalibrationSession> makeSession(
      const RigCalibrationSessionOptions& options = RigCalibrationSessionOptions()) {
    return std::make_unique<RigCalibrationSession>(
        oneCamera(), RigCalibratorOptions(), options,
        [this](const RigCalibrationSession::Status& /*status*/) { ++num_told_; },
        [](const ReconstructionState& /*state*/, const CameraRig& /*initial_rig*/) {},
        [this](const FinishedCalibration& work) { return on_result_(work); });
  }

  static Phase waitForEnd(const RigCalibrationSession& session) {
    const auto end = std::chrono::steady_clock::now() + std::chrono::seconds(20);
    while (session.status().phase == Phase::kCalibrating && std::chrono::steady_clock::now() < end) {
      std::this_thread::sleep_for(std::chrono::milliseconds(5));
    }
    return session.status().phase;
  }

  /// Retries until the previous calibration has ended.
  static bool beginToCalibrate(RigCalibrationSession* session) {
    std::string message;
    for (int i = 0; i < 1000; ++i) {
      if (session->calibrate(&message)) {
        return true;
      }
      std::this_thread::sleep_for(std::chrono::milliseconds(5));
    }
    return false;
  }

  std::function<std::string(const FinishedCalibration&)> on_result_ =
      [](const FinishedCalibration& /*work*/) { return ""; };
  std::atomic<int> num_told_{0};
};

TEST_F(RigCalibrationSessionTest, FailsWithTheReasonAndStartsAgain) {
  std::atomic<int> num_results{0};
  on_result_ = [&](const FinishedCalibration& work) {
    EXPECT_EQ(work.result.verdict, Verdict::kFail);
    ++num_results;
    return "nothing is lost";
  };
  const auto session = makeSession();
  EXPECT_EQ(session->status().phase, Phase::kFollowing);
  EXPECT_FALSE(session->status().outlook.isEnough());
  for (int i = 1; i <= 2; ++i) {
    ASSERT_TRUE(beginToCalibrate(session.get()));
    EXPECT_EQ(waitForEnd(*session), Phase::kFailed);
    EXPECT_EQ(session->status().message, "FAIL; no images in the drive; nothing is lost");
    ASSERT_NE(session->status().result, nullptr);
    EXPECT_EQ(num_results, i);
  }
  session->reset();
  EXPECT_EQ(session->status().phase, Phase::kFollowing);
  EXPECT_EQ(session->status().result, nullptr);
  EXPECT_EQ(session->status().message, "waiting for a drive");
  EXPECT_GT(num_told_, 4);
}

TEST_F(RigCalibrationSessionTest, FailsWhereTheResultCannotBeWritten) {
  on_result_ = [](const FinishedCalibration& /*work*/) -> std::string {
    throw InputError("rig.yaml: no space left");
  };
  const auto session = makeSession();
  ASSERT_TRUE(beginToCalibrate(session.get()));
  EXPECT_EQ(waitForEnd(*session), Phase::kFailed);
  EXPECT_EQ(session->status().message, "rig.yaml: no space left");
}

TEST_F(RigCalibrationSessionTest, ReportsNothingOfAnAbandonedDrive) {
  std::promise<void> begun, may_go_on;
  std::atomic<bool> is_first{true};
  on_result_ = [&](const FinishedCalibration& /*work*/) {
    if (is_first.exchange(false)) {
      begun.set_value();
      may_go_on.get_future().wait();
    }
    return "";
  };
  const auto session = makeSession();
  std::string message;
  ASSERT_TRUE(session->calibrate(&message));
  begun.get_future().wait();
  EXPECT_FALSE(session->calibrate(&message));
  EXPECT_EQ(message.find("already calibrating"), 0U) << message;
  session->reset();
  EXPECT_FALSE(session->calibrate(&message));
  EXPECT_NE(message.find("abandoned"), std::string::npos) << message;
  may_go_on.set_value();
  ASSERT_TRUE(beginToCalibrate(session.get())) << "the new drive";
  EXPECT_EQ(waitForEnd(*session), Phase::kFailed);
}

TEST_F(RigCalibrationSessionTest, EndsDuringACalibration) {
  const auto session = makeSession();
  std::string message;
  EXPECT_TRUE(session->calibrate(&message));
}

TEST_F(RigCalibrationSessionTest, RefusesBadOptionsByName) {
  RigCalibrationSessionOptions options;
  options.outlook_m = 0.0;
  EXPECT_THROW(makeSession(options), std::invalid_argument);
  options = RigCalibrationSessionOptions();
  options.coach.enough_turn_rad = -1.0;
  try {
    makeSession(options);
    FAIL();
  } catch (const std::invalid_argument& error) {
    EXPECT_NE(std::string(error.what()).find("enough_turn_rad"), std::string::npos) << error.what();
  }
}

}  // namespace
}  // namespace vcharge
