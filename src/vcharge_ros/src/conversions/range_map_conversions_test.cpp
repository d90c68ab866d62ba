#include "vcharge_ros/range_map_conversions.h"

#include <cmath>
#include <cstring>
#include <limits>

#include "vcharge_ros/conversions.h"
#include "vcharge_ros/test_support.h"

namespace vcharge {
namespace {

constexpr float kNan = std::numeric_limits<float>::quiet_NaN();
constexpr double kPlaneDepth_m = 2.5;

// A wall across the optical axis, seen where its range is below 8 m.
RangeMap makeWall(cv::Size size) {
  const double focal = 0.5 * size.width;
  RangeMap map{testing::milliseconds(40),
               "left",
               "camera_left_optical",
               MeiCamera(1.1, focal, focal, 0.5 * size.width, 0.5 * size.height),
               cv::Mat(size, CV_32FC1, cv::Scalar(kNan)),
               cv::Mat(size, CV_32FC1, cv::Scalar(0.1)),
               cv::Mat(size, CV_32FC1, cv::Scalar(0.5))};
  for (int y = 0; y < size.height; ++y) {
    for (int x = 0; x < size.width; ++x) {
      Eigen::Vector3d ray;
      if (map.camera.unproject(Eigen::Vector2d(x, y), &ray) && ray.z() > 0.3) {
        map.range_m.at<float>(y, x) = static_cast<float>(kPlaneDepth_m / ray.z());
      }
    }
  }
  return map;
}

std::array<float, 4> pointAt(const sensor_msgs::PointCloud2& cloud, size_t index) {
  std::array<float, 4> point;
  std::memcpy(point.data(), &cloud.data[index * cloud.point_step], sizeof(point));
  return point;
}

TEST(RangeMapConverterTest, PutsAWallsPointsOnTheWall) {
  const RangeMap map = makeWall(cv::Size(64, 40));
  RangeMapConverter converter(3.2);
  const RangeMapMessages messages = converter.convert(map, cv::Mat());
  const sensor_msgs::PointCloud2& cloud = *messages.points;
  const int num_known = cv::countNonZero(map.range_m == map.range_m);
  ASSERT_EQ(cloud.width, static_cast<uint32_t>(num_known));
  ASSERT_LT(num_known, map.range_m.size().area());
  ASSERT_EQ(cloud.data.size(), cloud.width * cloud.point_step);
  EXPECT_TRUE(cloud.is_dense);
  for (size_t i = 0; i < cloud.width; ++i) {
    ASSERT_NEAR(pointAt(cloud, i)[2], kPlaneDepth_m, 1e-5);
    ASSERT_FLOAT_EQ(pointAt(cloud, i)[3], 0.5f * 255.0f);
  }
}

TEST(RangeMapConverterTest, MakesNoPointsThatNobodyWants) {
  RangeMapConverter converter(3.2);
  const RangeMapMessages messages = converter.convert(makeWall(cv::Size(32, 20)), cv::Mat(), false);
  EXPECT_EQ(messages.points, nullptr);
  EXPECT_NE(messages.range, nullptr);
}

TEST(RangeMapConverterTest, TakesIntensityFromTheImage) {
  RangeMap map = makeWall(cv::Size(16, 10));
  map.range_m.setTo(kNan);
  map.range_m.at<float>(3, 5) = 2.0f;
  cv::Mat gray(10, 16, CV_8UC1, cv::Scalar(7));
  gray.at<uint8_t>(3, 5) = 201;
  RangeMapConverter converter(3.2);
  const RangeMapMessages messages = converter.convert(map, gray);
  ASSERT_EQ(messages.points->width, 1u);
  EXPECT_EQ(pointAt(*messages.points, 0)[3], 201.0f);
  ASSERT_TRUE(messages.reference);
  EXPECT_EQ(messages.reference->encoding, "mono8");
  EXPECT_EQ(messages.reference->data[3 * 16 + 5], 201);
  EXPECT_EQ(toTimestamp(messages.reference->header.stamp), map.stamp);
  Eigen::Vector3d ray;
  ASSERT_TRUE(map.camera.unproject(Eigen::Vector2d(5, 3), &ray));
  EXPECT_NEAR(pointAt(*messages.points, 0)[0], 2.0 * ray.x(), 1e-6);
  EXPECT_NEAR(pointAt(*messages.points, 0)[1], 2.0 * ray.y(), 1e-6);
}

TEST(RangeMapConverterTest, StampsAndFramesAllAlike) {
  const RangeMap map = makeWall(cv::Size(64, 40));
  RangeMapConverter converter(3.2);
  const RangeMapMessages messages = converter.convert(map, cv::Mat());
  EXPECT_FALSE(messages.reference);
  for (const std_msgs::Header& header :
       {messages.range->header, messages.confidence->header, messages.standard_deviation->header,
        messages.camera_info->header, messages.points->header}) {
    EXPECT_EQ(toTimestamp(header.stamp), map.stamp);
    EXPECT_EQ(header.frame_id, "camera_left_optical");
  }
  EXPECT_EQ(messages.range->encoding, "32FC1");
  EXPECT_EQ(messages.camera_info->width, 64u);
  EXPECT_EQ(messages.camera_info->distortion_model, "equidistant");
}

TEST(RangeMapConverterTest, FollowsACameraThatChanges) {
  RangeMapConverter converter(3.2);
  converter.convert(makeWall(cv::Size(64, 40)), cv::Mat());
  const RangeMapMessages messages = converter.convert(makeWall(cv::Size(32, 20)), cv::Mat());
  EXPECT_EQ(messages.camera_info->width, 32u);
  ASSERT_GT(messages.points->width, 0u);
  EXPECT_NEAR(pointAt(*messages.points, 0)[2], kPlaneDepth_m, 1e-5);
}

TEST(RangeMapConverterTest, RefusesImagesOfUnlikeSize) {
  RangeMap map = makeWall(cv::Size(64, 40));
  RangeMapConverter converter(3.2);
  EXPECT_THROW(converter.convert(map, cv::Mat(20, 32, CV_8UC1)), std::logic_error);
  map.confidence = cv::Mat(20, 32, CV_32FC1);
  EXPECT_THROW(converter.convert(map, cv::Mat()), std::logic_error);
}

}  // namespace
}  // namespace vcharge
