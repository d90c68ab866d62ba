#include "vcharge_ros/image_conversions.h"

#include <boost/make_shared.hpp>
#include <boost/weak_ptr.hpp>
#include <opencv2/imgcodecs.hpp>

#include "vcharge_ros/conversions.h"
#include "vcharge_ros/test_support.h"

namespace vcharge {
namespace {

using testing::expectInputError;

sensor_msgs::ImagePtr makeMessage(int width, int height, const std::string& encoding, int bytes_per_pixel,
                                  int padding = 0) {
  auto message = boost::make_shared<sensor_msgs::Image>();
  message->width = width;
  message->height = height;
  message->encoding = encoding;
  message->step = width * bytes_per_pixel + padding;
  message->data.resize(message->step * height);
  for (size_t i = 0; i < message->data.size(); ++i) {
    message->data[i] = static_cast<uint8_t>(37 * i + 11);
  }
  return message;
}

TEST(ImageConversionsTest, SharesTheBufferOfGrayMessages) {
  const sensor_msgs::ImageConstPtr message = makeMessage(7, 5, "mono8", 1, 3);
  const Image image = toImage(message, "topic");
  EXPECT_EQ(image.pixels.data, message->data.data());
  EXPECT_EQ(image.pixels.size(), cv::Size(7, 5));
  EXPECT_EQ(image.pixels.step, 10u);
  EXPECT_EQ(image.pixels.at<uint8_t>(2, 6), message->data[26]);
}

TEST(ImageConversionsTest, KeepsTheMessageAliveForTheImagesLife) {
  sensor_msgs::ImageConstPtr message = makeMessage(7, 5, "mono8", 1);
  const boost::weak_ptr<const sensor_msgs::Image> watched = message;
  Image image = toImage(message, "topic");
  const uint8_t first = message->data[0];
  message.reset();
  ASSERT_FALSE(watched.expired());
  const Image copy = image;
  image = Image();
  ASSERT_FALSE(watched.expired());
  EXPECT_EQ(copy.pixels.at<uint8_t>(0, 0), first);
}

TEST(ImageConversionsTest, ReleasesTheMessageWithTheImage) {
  sensor_msgs::ImageConstPtr message = makeMessage(7, 5, "mono8", 1);
  const boost::weak_ptr<const sensor_msgs::Image> watched = message;
  { const Image image = toImage(message, "topic"); }
  message.reset();
  EXPECT_TRUE(watched.expired());
}

TEST(ImageConversionsTest, WeighsColoursAsLuma) {
  // ITU-R BT.601: 0.299 R + 0.587 G + 0.114 B.
  const auto expectGray = [](const std::string& encoding, const std::vector<uint8_t>& pixel,
                             double expected) {
    const sensor_msgs::ImagePtr message = makeMessage(1, 1, encoding, static_cast<int>(pixel.size()));
    message->data = pixel;
    EXPECT_NEAR(toImage(message, "topic").pixels.at<uint8_t>(0, 0), expected, 1.0) << encoding;
  };
  expectGray("rgb8", {200, 100, 50}, 0.299 * 200 + 0.587 * 100 + 0.114 * 50);
  expectGray("bgr8", {200, 100, 50}, 0.299 * 50 + 0.587 * 100 + 0.114 * 200);
  expectGray("rgba8", {200, 100, 50, 0}, 0.299 * 200 + 0.587 * 100 + 0.114 * 50);
  expectGray("bgra8", {200, 100, 50, 0}, 0.299 * 50 + 0.587 * 100 + 0.114 * 200);
}

TEST(ImageConversionsTest, TakesTheUpperBitsOfSixteen) {
  const sensor_msgs::ImagePtr message = makeMessage(2, 1, "mono16", 2);
  message->data = {0x34, 0x12, 0xff, 0xab};
  EXPECT_EQ(toImage(message, "topic").pixels.at<uint8_t>(0, 0), 0x12);
  EXPECT_EQ(toImage(message, "topic").pixels.at<uint8_t>(0, 1), 0xab);
  message->is_bigendian = 1;
  EXPECT_EQ(toImage(message, "topic").pixels.at<uint8_t>(0, 0), 0x34);
}

TEST(ImageConversionsTest, NamesTopicAndEncodingItCannotTake) {
  expectInputError([] { toImage(makeMessage(4, 4, "bayer_rggb8", 1), "/camera/left/image_raw"); },
                   {"/camera/left/image_raw", "mono8", "bayer_rggb8"});
}

TEST(ImageConversionsTest, RefusesDataThatDoNotFillTheImage) {
  const sensor_msgs::ImagePtr message = makeMessage(4, 4, "mono8", 1);
  message->data.pop_back();
  expectInputError([&] { toImage(message, "topic"); }, {"topic", "15 bytes", "4x4"});
  message->data.resize(16);
  message->step = 3;
  expectInputError([&] { toImage(message, "topic"); }, {"topic", "step 3"});
  message->width = 0;
  expectInputError([&] { toImage(message, "topic"); }, {"topic", "0x4"});
  message->height = 0xffffffff;  // times the step exceeds 32 bits
  message->width = message->step = 0xffffffff;
  expectInputError([&] { toImage(message, "topic"); }, {"topic"});
}

TEST(ImageConversionsTest, DecodesCompressedImages) {
  cv::Mat pixels(20, 30, CV_8UC1);
  for (int i = 0; i < 600; ++i) {
    pixels.at<uint8_t>(i / 30, i % 30) = static_cast<uint8_t>(i % 251);
  }
  auto message = boost::make_shared<sensor_msgs::CompressedImage>();
  message->format = "png";
  cv::imencode(".png", pixels, message->data);
  EXPECT_EQ(cv::norm(toImage(message, "topic").pixels, pixels, cv::NORM_INF), 0.0);
}

TEST(ImageConversionsTest, NamesTopicOfACompressedImageThatCannotBeDecoded) {
  auto message = boost::make_shared<sensor_msgs::CompressedImage>();
  message->format = "jpeg";
  expectInputError([&] { toImage(message, "/camera/left/image_raw/compressed"); },
                   {"/camera/left/image_raw/compressed", "0 bytes", "jpeg"});
  message->data = {1, 2, 3, 4, 5};
  expectInputError([&] { toImage(message, "topic"); }, {"topic", "5 bytes"});
}

TEST(ImageConversionsTest, WritesGrayAndFloatImagesRowByRow) {
  cv::Mat pixels(4, 6, CV_32FC1);
  cv::randu(pixels, 0.0, 1.0);
  const cv::Mat part = pixels(cv::Rect(1, 1, 3, 2));  // rows are not contiguous in memory
  const sensor_msgs::ImagePtr message = toImageMessage(part, testing::milliseconds(5), "frame");
  EXPECT_EQ(message->encoding, "32FC1");
  EXPECT_EQ(message->step, 12u);
  ASSERT_EQ(message->data.size(), 24u);
  const cv::Mat read(2, 3, CV_32FC1, message->data.data());
  EXPECT_EQ(cv::norm(read, part, cv::NORM_INF), 0.0);
  EXPECT_EQ(toTimestamp(message->header.stamp), testing::milliseconds(5));
  EXPECT_THROW(toImageMessage(cv::Mat(2, 2, CV_8UC3), testing::milliseconds(5), "frame"), std::logic_error);
}

}  // namespace
}  // namespace vcharge
