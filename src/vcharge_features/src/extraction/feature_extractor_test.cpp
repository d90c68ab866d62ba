#include "vcharge_features/feature_extractor.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <opencv2/imgproc.hpp>

#include "extraction/test_images.h"
#include "vcharge_features/descriptor_matching.h"

namespace vcharge {
namespace {

using ::testing::HasSubstr;
using ::testing::ThrowsMessage;

class FeatureExtractorTest : public ::testing::TestWithParam<FeatureType> {
 protected:
  static FeatureExtractorOptions options(int max_features = 500) {
    FeatureExtractorOptions options;
    options.type = GetParam();
    options.max_features = max_features;
    return options;
  }
};

TEST_P(FeatureExtractorTest, FindsAShiftedImageAgain) {
  const cv::Mat image = randomTexture({500, 360}, 1);
  const cv::Point shift(11, 6);
  const cv::Mat first = image(cv::Rect(0, 0, 480, 340)).clone();
  const cv::Mat second = image(cv::Rect(shift.x, shift.y, 480, 340)).clone();
  const auto extractor = makeFeatureExtractor(options());
  const ImageFeatures a = extractor->extract(first);
  const ImageFeatures b = extractor->extract(second);
  ASSERT_GT(a.size(), 200U);
  ASSERT_EQ(a.descriptors.type(), extractor->descriptorType());
  ASSERT_EQ(a.descriptors.cols, extractor->descriptorColumns());
  ASSERT_EQ(a.descriptors.rows, static_cast<int>(a.size()));
  int right = 0;
  const std::vector<FeatureMatch> matches = matchDescriptors(a.descriptors, b.descriptors);
  for (const FeatureMatch& match : matches) {
    const cv::Point2f offset =
        a.keypoints[match.first_index].position_px - b.keypoints[match.second_index].position_px;
    right += cv::norm(offset - cv::Point2f(shift)) < 1.0 ? 1 : 0;
  }
  EXPECT_GT(matches.size(), a.size() / 3);
  EXPECT_GT(right, 0.95 * static_cast<double>(matches.size()));
}

TEST_P(FeatureExtractorTest, StaysInsideTheMaskAndTheMaximum) {
  const cv::Mat image = randomTexture({480, 340}, 2);
  cv::Mat mask = cv::Mat::zeros(image.size(), CV_8UC1);
  cv::circle(mask, {240, 170}, 120, cv::Scalar(1), -1);
  const ImageFeatures features = makeFeatureExtractor(options(60))->extract(image, mask);
  EXPECT_LE(features.size(), 60U);
  EXPECT_GT(features.size(), 40U);
  for (const Keypoint& keypoint : features.keypoints) {
    EXPECT_LT(cv::norm(keypoint.position_px - cv::Point2f(240.0F, 170.0F)), 121.5);
    EXPECT_GT(keypoint.size_px, 0.0F);
    EXPECT_GE(keypoint.angle_rad, 0.0F);
    EXPECT_LT(keypoint.angle_rad, 6.2832F);
  }
  EXPECT_TRUE(makeFeatureExtractor(options())->extract(image, cv::Mat::zeros(image.size(), CV_8UC1)).empty());
}

TEST(FastBriefExtractorTest, TakesWeakerCornersInADarkImage) {
  const cv::Mat image = randomTexture({480, 340}, 4);
  cv::Mat dark;
  image.convertTo(dark, -1, 0.5);
  FeatureExtractorOptions options;
  options.max_features = 400;
  const ImageFeatures bright = makeFeatureExtractor(options)->extract(image);
  const ImageFeatures found = makeFeatureExtractor(options)->extract(dark);
  ASSERT_GT(bright.size(), 300U);
  EXPECT_GT(found.size(), bright.size() * 9 / 10);
  EXPECT_GT(matchDescriptors(bright.descriptors, found.descriptors).size(), bright.size() / 2);
}

TEST_P(FeatureExtractorTest, SpreadsFeaturesOverTheImage) {
  // The left half has the stronger contrast and would otherwise get nearly all features.
  cv::Mat image = randomTexture({640, 400}, 3);
  cv::Mat right_half = image(cv::Rect(320, 0, 320, 400));
  right_half.convertTo(right_half, -1, 0.6, 50.0);
  const ImageFeatures features = makeFeatureExtractor(options(120))->extract(image);
  ASSERT_GE(features.size(), 100U);
  int right = 0;
  for (const Keypoint& keypoint : features.keypoints) {
    right += keypoint.position_px.x >= 320.0F ? 1 : 0;
  }
  EXPECT_GT(right, static_cast<int>(features.size()) / 3);
}

TEST_P(FeatureExtractorTest, GivesTheSameOnAnyNumberOfThreads) {
  const cv::Mat image = randomTexture({480, 340}, 4);
  const auto extractor = makeFeatureExtractor(options(200));
  const int threads = cv::getNumThreads();
  cv::setNumThreads(1);
  const ImageFeatures one = extractor->extract(image);
  cv::setNumThreads(4);
  const ImageFeatures four = extractor->extract(image);
  cv::setNumThreads(threads);
  ASSERT_EQ(one.size(), four.size());
  for (size_t i = 0; i < one.size(); ++i) {
    EXPECT_EQ(one.keypoints[i].position_px, four.keypoints[i].position_px);
  }
  EXPECT_EQ(cv::norm(one.descriptors, four.descriptors, cv::NORM_INF), 0.0);
}

TEST_P(FeatureExtractorTest, APartOfAnImageGivesWhatItsCopyGives) {
  const cv::Mat image = randomTexture({480, 340}, 8);
  const cv::Mat part = image(cv::Rect(31, 17, 401, 283));
  const auto extractor = makeFeatureExtractor(options(200));
  const ImageFeatures of_part = extractor->extract(part);
  const ImageFeatures of_copy = extractor->extract(part.clone());
  ASSERT_GT(of_part.size(), 100U);
  ASSERT_EQ(of_part.size(), of_copy.size());
  EXPECT_EQ(cv::norm(of_part.descriptors, of_copy.descriptors, cv::NORM_INF), 0.0);
}

TEST_P(FeatureExtractorTest, PlainAndTinyImagesHaveNoFeatures) {
  const auto extractor = makeFeatureExtractor(options());
  for (const cv::Size& size : {cv::Size(1, 1), cv::Size(3, 500), cv::Size(33, 33), cv::Size(300, 200)}) {
    const ImageFeatures features = extractor->extract(cv::Mat(size, CV_8UC1, cv::Scalar(90)));
    EXPECT_TRUE(features.empty());
    EXPECT_EQ(features.descriptors.rows, 0);
    EXPECT_EQ(features.descriptors.type(), extractor->descriptorType());
    EXPECT_EQ(features.descriptors.cols, extractor->descriptorColumns());
  }
}

TEST_P(FeatureExtractorTest, BadImagesAreNamed) {
  const auto extractor = makeFeatureExtractor(options());
  const auto throwing = [](const char* text) {
    return ThrowsMessage<std::invalid_argument>(HasSubstr(text));
  };
  const cv::Mat image = randomTexture({100, 80}, 1);
  EXPECT_THAT([&] { extractor->extract(cv::Mat()); }, throwing("image: expected a non-empty"));
  EXPECT_THAT([&] { extractor->extract(cv::Mat::zeros(50, 50, CV_8UC3)); }, throwing("got 50x50 CV_8UC3"));
  EXPECT_THAT([&] { extractor->extract(cv::Mat::zeros(50, 50, CV_32FC1)); }, throwing("image"));
  EXPECT_THAT([&] { extractor->extract(image, cv::Mat::zeros(80, 99, CV_8UC1)); }, throwing("mask"));
  EXPECT_THAT([&] { extractor->extract(image, cv::Mat::zeros(80, 100, CV_32FC1)); }, throwing("mask"));
}

INSTANTIATE_TEST_SUITE_P(AllTypes, FeatureExtractorTest,
                         ::testing::Values(FeatureType::kFastBrief, FeatureType::kRootSift),
                         [](const auto& parameter) {
                           return enumNames<FeatureType>()[static_cast<size_t>(parameter.param)];
                         });

TEST(FeatureExtractorOptionsTest, DefaultsForMappingAndLocalizationAreValid) {
  EXPECT_EQ(makeFeatureExtractor(FeatureExtractorOptions::mapping())->descriptorType(), CV_32FC1);
  EXPECT_EQ(makeFeatureExtractor()->descriptorType(), CV_8UC1);
}

TEST(FeatureExtractorOptionsTest, BadFieldsAreNamed) {
  const auto errorOf = [](const std::function<void(FeatureExtractorOptions*)>& spoil) -> std::string {
    FeatureExtractorOptions options;
    spoil(&options);
    try {
      makeFeatureExtractor(options);
    } catch (const std::invalid_argument& error) {
      return error.what();
    }
    return "";
  };
  EXPECT_THAT(errorOf([](auto* o) { o->max_features = 0; }), HasSubstr("max_features"));
  EXPECT_THAT(errorOf([](auto* o) { o->fast_threshold = 255; }), HasSubstr("fast_threshold"));
  EXPECT_THAT(errorOf([](auto* o) { o->sift_contrast_threshold = std::nan(""); }),
              HasSubstr("sift_contrast_threshold"));
  EXPECT_THAT(errorOf([](auto* o) { o->type = static_cast<FeatureType>(17); }), HasSubstr("type"));
}

TEST(FeatureMaskTest, IsWhereTheCameraSeesAndTheMaskAllows) {
  RigCamera camera{
      "left", "camera_left_optical", {64, 48}, MeiCamera(1.0, 40.0, 40.0, 31.5, 23.5), 1.0, "", {}, {}, {}};
  camera.mask = cv::Mat(48, 64, CV_8UC1, cv::Scalar(255));
  camera.mask.colRange(0, 32) = 0;
  const cv::Mat mask = makeFeatureMask(camera);
  for (int y = 0; y < 48; ++y) {
    for (int x = 0; x < 64; ++x) {
      Eigen::Vector3d ray;
      const bool seen = camera.model.unproject(Eigen::Vector2d(x, y), &ray) && ray.z() >= std::cos(0.5);
      EXPECT_EQ(mask.at<uint8_t>(y, x), seen && x >= 32 ? 255 : 0);
    }
  }
}

}  // namespace
}  // namespace vcharge
