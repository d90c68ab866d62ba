#include "vcharge_recordings/bag_images.h"

#include <filesystem>
#include <fstream>

#include <gtest/gtest.h>
#include <rosbag/bag.h>
#include <sensor_msgs/CompressedImage.h>
#include <opencv2/imgcodecs.hpp>

#include "vcharge_core/base/error.h"
#include "vcharge_ros/conversions.h"
#include "vcharge_ros/image_conversions.h"

namespace vcharge {
namespace {

namespace fs = std::filesystem;

class BagImagesTest : public ::testing::Test {
 protected:
  // Writes ten images of gray value 10 i to /raw, the same as PNG to /packed/compressed, a word to /other.
  void SetUp() override {
    folder_ = fs::temp_directory_path() / (std::string("vcharge_bag_images_") +
                                           ::testing::UnitTest::GetInstance()->current_test_info()->name());
    fs::create_directories(folder_);
    rosbag::Bag bag(path(), rosbag::bagmode::Write);
    for (int i = 0; i < 10; ++i) {
      const cv::Mat pixels(4, 6, CV_8UC1, cv::Scalar(10 * i));
      const auto message =
          toImageMessage(pixels, Timestamp::fromNanoseconds(1000000000LL * (i + 1)), "camera");
      bag.write("/raw", message->header.stamp, *message);
      sensor_msgs::CompressedImage compressed;
      compressed.header = message->header;
      compressed.format = "png";
      cv::imencode(".png", pixels, compressed.data);
      bag.write("/packed/compressed", message->header.stamp, compressed);
      bag.write("/other", message->header.stamp, message->header);
    }
  }
  void TearDown() override { fs::remove_all(folder_); }
  std::string path() const { return (folder_ / "images.bag").string(); }
  static std::string errorOf(const std::string& bag, const std::string& topic) {
    try {
      readBagImages(bag, topic, 5, [](double /*fraction*/) {});
    } catch (const InputError& error) {
      return error.what();
    }
    return "";
  }

  fs::path folder_;
};

TEST_F(BagImagesTest, ReadsRawAndCompressedImagesWithTheirStamps) {
  for (const char* topic : {"/raw", "/packed", "/packed/compressed"}) {
    double fraction = 0.0;
    const auto images = readBagImages(path(), topic, 100, [&](double done) { fraction = done; });
    ASSERT_EQ(images.size(), 10U) << topic;
    EXPECT_EQ(fraction, 1.0);
    for (int i = 0; i < 10; ++i) {
      EXPECT_EQ(images[static_cast<size_t>(i)].image.pixels.at<uint8_t>(3, 5), 10 * i) << topic;
      EXPECT_EQ(toString(images[static_cast<size_t>(i)].stamp),
                toString(Timestamp::fromNanoseconds(1000000000LL * (i + 1))));
    }
  }
}

TEST_F(BagImagesTest, TakesAsManyAsWantedEvenlySpread) {
  const auto images = readBagImages(path(), "/raw", 5, [](double /*fraction*/) {});
  ASSERT_EQ(images.size(), 5U);
  for (int i = 0; i < 5; ++i) {
    EXPECT_EQ(images[static_cast<size_t>(i)].image.pixels.at<uint8_t>(0, 0), 20 * i);
  }
}

TEST_F(BagImagesTest, NamesWhatIsWrong) {
  EXPECT_NE(errorOf(path(), "/none").find("/raw (sensor_msgs/Image)"), std::string::npos);
  EXPECT_NE(errorOf(path(), "/other").find("expected images on /other"), std::string::npos);
  EXPECT_NE(errorOf(path() + "x", "/raw").find("no such file"), std::string::npos);
  const std::string bad = (folder_ / "bad.bag").string();
  std::ofstream(bad) << "no bag";
  EXPECT_NE(errorOf(bad, "/raw").find("bad.bag"), std::string::npos);
}

}  // namespace
}  // namespace vcharge
