#include "vcharge_localization/camera_health.h"

#include <gtest/gtest.h>

#include "vcharge_reconstruction/testing/test_map.h"

namespace vcharge {
namespace {

class CameraHealthTest : public ::testing::Test {
 protected:
  ImageFrame frameAt(double x_m, int gray_of_first, int gray_of_second) const {
    ImageFrame frame;
    frame.odom_from_vehicle = RigidTransform::planar(x_m, 0.0, 0.0);
    frame.images = {{cv::Mat(64, 64, CV_8UC1, cv::Scalar(gray_of_first)), nullptr},
                    {cv::Mat(64, 64, CV_8UC1, cv::Scalar(gray_of_second)), nullptr}};
    return frame;
  }
  void addFixes(int count, int inliers_of_second, int inliers_of_first = 90, int matches_of_second = 100) {
    PoseFix fix;
    fix.matches_of_camera = {100, matches_of_second};
    fix.inliers_of_camera = {inliers_of_first, inliers_of_second};
    for (int i = 0; i < count; ++i) {
      health_.addFix(fix);
    }
  }
  void addFeatures(int count, int num_of_second) {
    RigFeatures features;
    features.images.resize(2);
    features.images[0].keypoints.resize(500);
    features.images[1].keypoints.resize(static_cast<size_t>(num_of_second));
    for (int i = 0; i < count; ++i) {
      health_.addFeatures(features);
    }
  }
  const std::shared_ptr<const SparseMap> map_ = testing::makeTestMap({});
  CameraHealth health_{std::shared_ptr<const CameraRig>(map_, &map_->rig()), CameraHealthOptions()};
};

TEST_F(CameraHealthTest, GoodCamerasHaveNoWarning) {
  for (int i = 0; i < 20; ++i) {
    health_.usableImages(frameAt(0.2 * i, i, 100 + i));
  }
  addFeatures(20, 500);
  addFixes(20, 90);
  EXPECT_TRUE(health_.warnings().empty());
}

TEST_F(CameraHealthTest, AFrozenCameraIsNamedAndLeftOutWhileTheVehicleMoves) {
  for (int i = 0; i < 6; ++i) {
    health_.usableImages(frameAt(0.0, i, 100));
  }
  EXPECT_TRUE(health_.warnings().empty()) << "a vehicle that stands may see the same";
  std::vector<Image> images;
  for (int i = 1; i < 6; ++i) {
    images = health_.usableImages(frameAt(0.2 * i, i, 100));
  }
  EXPECT_FALSE(images[0].pixels.empty());
  EXPECT_TRUE(images[1].pixels.empty());
  ASSERT_EQ(health_.warnings().size(), 1u);
  EXPECT_NE(health_.warnings()[0].find("left: frozen"), std::string::npos) << health_.warnings()[0];
}

TEST_F(CameraHealthTest, ACameraThatMovedIsNamedAndLeftOut) {
  RigCondition condition(2);
  condition[1].has_moved = true;
  health_.setCondition(condition);
  const std::vector<Image> images = health_.usableImages(frameAt(0.2, 50, 100));
  EXPECT_FALSE(images[0].pixels.empty());
  EXPECT_TRUE(images[1].pixels.empty());
  ASSERT_EQ(health_.warnings().size(), 1u);
  EXPECT_EQ(health_.warnings()[0].find("left: left out, since it moved"), 0u) << health_.warnings()[0];
  health_.setCondition(RigCondition(2));
  EXPECT_FALSE(health_.usableImages(frameAt(0.4, 51, 101))[1].pixels.empty());
  EXPECT_TRUE(health_.warnings().empty());
}

TEST_F(CameraHealthTest, ABlindCameraIsNamed) {
  addFeatures(30, 3);
  ASSERT_EQ(health_.warnings().size(), 1u);
  EXPECT_NE(health_.warnings()[0].find("left: few features"), std::string::npos);
}

TEST_F(CameraHealthTest, ACameraThatContradictsTheOthersIsNamed) {
  addFeatures(30, 500);
  addFixes(30, 5);
  ASSERT_EQ(health_.warnings().size(), 1u);
  EXPECT_NE(health_.warnings()[0].find("wrong intrinsics"), std::string::npos);
}

TEST_F(CameraHealthTest, CamerasThatAgreeAboutAsRarelyAsEachOtherHaveNoWarning) {
  addFeatures(30, 500);
  addFixes(30, 15, 18);
  EXPECT_TRUE(health_.warnings().empty()) << health_.warnings()[0];
}

TEST_F(CameraHealthTest, ACameraWhoseLandmarksAreNotWhereItSeesThemIsNamed) {
  addFeatures(30, 500);
  addFixes(30, 0, 90, 1);
  ASSERT_EQ(health_.warnings().size(), 1u);
  EXPECT_EQ(health_.warnings()[0].find("left: hardly any of its features (0 of "), 0u)
      << health_.warnings()[0];
}

TEST_F(CameraHealthTest, ABumpedCameraIsNamedWithinThreeMemories) {
  addFeatures(60, 500);
  addFixes(24, 40, 40, 100);
  EXPECT_TRUE(health_.warnings().empty());
  addFixes(32, 0, 40, 30);  // features near a projection match by chance, but fit no pose
  ASSERT_EQ(health_.warnings().size(), 1u);
  EXPECT_EQ(health_.warnings()[0].find("left: hardly any"), 0u) << health_.warnings()[0];
}

TEST_F(CameraHealthTest, ACameraAloneContradictsNobody) {
  PoseFix fix;
  fix.matches_of_camera = {0, 100};
  fix.inliers_of_camera = {0, 12};
  RigFeatures features;
  features.images.resize(2);
  features.images[1].keypoints.resize(500);
  for (int i = 0; i < 30; ++i) {
    health_.addFeatures(features);
    health_.addFix(fix);
  }
  ASSERT_EQ(health_.warnings().size(), 1u);
  EXPECT_EQ(health_.warnings()[0].find("front: few features"), 0u) << health_.warnings()[0];
}

TEST_F(CameraHealthTest, AMissingImageIsNamed) {
  ImageFrame frame = frameAt(0.0, 1, 2);
  frame.images[0] = Image();
  health_.usableImages(frame);
  ASSERT_EQ(health_.warnings().size(), 1u);
  EXPECT_EQ(health_.warnings()[0], "front: no image");
}

}  // namespace
}  // namespace vcharge
