#include "vcharge_reconstruction/keyframe_images.h"

#include <vector>

#include <gtest/gtest.h>

namespace vcharge {
namespace {

TEST(KeyframeImagesTest, KeepsAFewDistributedOverTheDrive) {
  KeyframeImages images;
  const Image large{cv::Mat(400, 1280, CV_8UC1, cv::Scalar(77)), nullptr};
  for (int32_t keyframe = 0; keyframe < 500; ++keyframe) {
    images.add(keyframe, {large, Image()});
  }
  const std::vector<int32_t> kept = images.keyframes();
  EXPECT_LE(kept.size(), KeyframeImages::kMaxKeyframes);
  EXPECT_GE(kept.size(), KeyframeImages::kMaxKeyframes / 2);
  for (size_t i = 1; i < kept.size(); ++i) {
    EXPECT_EQ(kept[i] - kept[i - 1], kept[1] - kept[0]);
  }
  EXPECT_GT(kept.back(), 480);
  EXPECT_EQ(images.image(kept[3], 0).size(), cv::Size(640, 200));
  EXPECT_NEAR(images.image(kept[3], 0).at<uint8_t>(100, 100), 77, 3);
  EXPECT_TRUE(images.image(kept[3], 1).empty());
  EXPECT_TRUE(images.image(kept[3], 2).empty());
  EXPECT_TRUE(images.image(kept[3] + 1, 0).empty());
}

}  // namespace
}  // namespace vcharge
