#include "vcharge_dense/surround_view.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "surround_view/exposure_balance.h"
#include "surround_view/test_world.h"
#include "vcharge_core/base/error.h"

namespace vcharge {
namespace {

class SurroundViewTest : public ::testing::Test {
 protected:
  SurroundViewTest() {
    options_.pixel_m = 0.1;
    options_.reach_m = 3.0;
    options_.frames.waitForEverything();
  }
  SurroundView make() {
    return SurroundView(rig_, options_, [this](const SurroundFrame& frame) {
      frames_.push_back({frame.stamp, frame.image.clone(), frame.labels.clone(), frame.gains, frame.shading});
    });
  }
  void addOdometry(double time_s, double x_m, SurroundView* view) const {
    VehicleOdometry odometry;
    odometry.stamp = Timestamp::fromSeconds(time_s);
    odometry.odom_from_vehicle = RigidTransform::planar(x_m, 0.0, 0.0);
    view->addOdometry(odometry);
  }
  void addImages(double time_s, double x_m, SurroundView* view) const {
    for (size_t camera = 0; camera < rig_->cameras.size(); ++camera) {
      view->addImage(camera, Timestamp::fromSeconds(time_s),
                     {world_.render(rig_->cameras[camera], RigidTransform::planar(x_m, 0.0, 0.0)), nullptr});
    }
  }
  int numRemembered(size_t frame) const { return cv::countNonZero(frames_[frame].labels == kSurroundMemory); }

  const std::shared_ptr<const CameraRig> rig_ = std::make_shared<const CameraRig>(makeTestRig());
  const TestWorld world_;
  SurroundViewOptions options_;
  std::vector<SurroundFrame> frames_;
};

TEST_F(SurroundViewTest, ForgetsTheGroundWhenTheOdometerJumps) {
  SurroundView view = make();
  double offset_m = 0.0;
  for (int step = 0; step < 8; ++step) {
    const double time_s = 1.0 + 0.1 * step, x_m = 0.5 * step;
    offset_m = step < 5 ? 0.0 : 100.0;
    addOdometry(time_s - 0.05, x_m - 0.25 + offset_m, &view);
    addOdometry(time_s, x_m + offset_m, &view);
    addImages(time_s, x_m, &view);
  }
  view.finish();
  ASSERT_EQ(frames_.size(), 8U);
  EXPECT_EQ(numRemembered(0), 0);
  EXPECT_GT(numRemembered(4), 200);
  EXPECT_EQ(numRemembered(5), 0);
  EXPECT_GT(numRemembered(7), 50);
}

TEST_F(SurroundViewTest, RejectsImagesThatAreNotTheCamerasGrayImages) {
  SurroundView view = make();
  const cv::Size size = rig_->cameras[0].image_size_px;
  for (const cv::Mat& bad :
       {cv::Mat(), cv::Mat(100, 100, CV_8UC1, cv::Scalar(0)), cv::Mat(size, CV_8UC3, cv::Scalar(0)),
        cv::Mat(size, CV_32FC1, cv::Scalar(NAN))}) {
    try {
      view.addImage(0, Timestamp::fromNanoseconds(1), {bad, nullptr});
      ADD_FAILURE();
    } catch (const InputError& error) {
      EXPECT_THAT(error.what(), ::testing::HasSubstr("camera front: expected a gray image of 640 x 400"));
    }
  }
}

TEST_F(SurroundViewTest, UsesOnlyTheNamedCameras) {
  SurroundView view(rig_, options_,
                    [this](const SurroundFrame& frame) {
                      frames_.push_back({frame.stamp, frame.image.clone(), frame.labels.clone(), frame.gains,
                                         frame.shading});
                    },
                    {"rear"});
  addOdometry(1.0, 0.0, &view);
  addImages(1.0, 0.0, &view);
  view.finish();
  ASSERT_EQ(frames_.size(), 1U);
  EXPECT_GT(cv::countNonZero(frames_[0].labels == 2), 500);
  EXPECT_EQ(
      cv::countNonZero(frames_[0].labels == 2) + cv::countNonZero(frames_[0].labels == kSurroundUnknown),
      static_cast<int>(frames_[0].labels.total()));
  EXPECT_THROW(SurroundView(rig_, options_, nullptr, {"roof"}), InputError);
}

TEST(ExposureBalanceTest, IsNotMovedByAMinorityAndStaysWithoutPairs) {
  ExposureBalance balance(3);
  std::vector<GrayPair> pairs;
  for (int i = 0; i < 1000; ++i) {
    pairs.push_back(i < 600 ? GrayPair{0, 1, 100, 50} : GrayPair{0, 1, 60, 240});
    pairs.push_back({2, 1, 100, 100});
  }
  balance.update(pairs);
  EXPECT_NEAR(balance.gains()[1] / balance.gains()[0], 2.0, 0.02);
  EXPECT_NEAR(balance.gains()[1] / balance.gains()[2], 1.0, 0.02);
  const std::vector<double> gains = balance.gains();
  balance.update({});
  EXPECT_EQ(balance.gains(), gains);
}

TEST(ExposureBalanceTest, FollowsAChangeOfTheExposureWithinHalfASecond) {
  ExposureBalance balance(2);
  balance.update(std::vector<GrayPair>(100, GrayPair{0, 1, 100, 100}));
  for (int frame = 0; frame < 6; ++frame) {
    balance.update(std::vector<GrayPair>(100, GrayPair{0, 1, 50, 100}));
  }
  EXPECT_NEAR(50.0 * balance.gains()[0], 100.0 * balance.gains()[1], 4.0);
}

TEST(ExposureBalanceTest, IgnoresSaturatedAndDarkPixels) {
  ExposureBalance balance(2);
  balance.update(std::vector<GrayPair>(1000, GrayPair{0, 1, 255, 100}));
  balance.update(std::vector<GrayPair>(1000, GrayPair{0, 1, 2, 40}));
  EXPECT_EQ(balance.gains(), std::vector<double>({1.0, 1.0}));
}

}  // namespace
}  // namespace vcharge
