#include "vcharge_core/dense_maps/range_map_file.h"

#include <cmath>
#include <filesystem>
#include <limits>

#include <gtest/gtest.h>

#include "vcharge_core/base/error.h"
#include "vcharge_core/files/file_io.h"

namespace vcharge {
namespace {

RangeMap makeMap(int64_t stamp_ns) {
  const float nan = std::numeric_limits<float>::quiet_NaN();
  RangeMap map{Timestamp::fromNanoseconds(stamp_ns),
               "left",
               "camera_left_optical",
               MeiCamera(1.1, 300, 301, 160, 100),
               cv::Mat(20, 32, CV_32FC1, cv::Scalar(4.25)),
               cv::Mat(20, 32, CV_32FC1, cv::Scalar(0.1)),
               cv::Mat(20, 32, CV_32FC1, cv::Scalar(0.5))};
  map.range_m.at<float>(3, 4) = nan;
  map.standard_deviation_m.at<float>(3, 4) = nan;
  map.confidence.at<float>(3, 4) = 0.0F;
  return map;
}

std::string hashOf(const RangeMap& map) {
  ContentHasher hasher;
  addToHash(map, &hasher);
  return hasher.hex();
}

class RangeMapFileTest : public ::testing::Test {
 protected:
  void SetUp() override {
    folder_ = ::testing::TempDir() + "range_map_file_test";
    std::filesystem::remove_all(folder_);
  }
  std::string folder_;
};

TEST_F(RangeMapFileTest, SurvivesWritingAndReadingExactly) {
  const RangeMap map = makeMap(1342626148354042000);
  writeRangeMap(makeMap(1342626148434042000), folder_);
  writeRangeMap(map, folder_);
  EXPECT_EQ(listRangeMapCameras(folder_), std::vector<std::string>{"left"});
  const std::vector<Timestamp> stamps = listRangeMaps(folder_, "left");
  ASSERT_EQ(stamps.size(), 2U);
  EXPECT_EQ(stamps[0], map.stamp);
  EXPECT_EQ(hashOf(readRangeMap(folder_, "left", map.stamp)), hashOf(map));
}

TEST_F(RangeMapFileTest, KeepsTheReferenceWhereThereIsOne) {
  RangeMap map = makeMap(1);
  map.reference = cv::Mat(20, 32, CV_8UC1, cv::Scalar(7));
  map.reference.at<uint8_t>(3, 5) = 201;
  writeRangeMap(map, folder_);
  const RangeMap read = readRangeMap(folder_, "left", map.stamp);
  ASSERT_EQ(read.reference.size(), map.reference.size());
  EXPECT_EQ(cv::countNonZero(read.reference != map.reference), 0);
  writeRangeMap(makeMap(1), folder_);  // replaced by a map without a reference
  EXPECT_TRUE(readRangeMap(folder_, "left", map.stamp).reference.empty());
  map.reference = cv::Mat(10, 32, CV_8UC1, cv::Scalar(7));
  EXPECT_THROW(writeRangeMap(map, folder_), std::logic_error);
}

TEST_F(RangeMapFileTest, HashFollowsEveryPixel) {
  const RangeMap map = makeMap(1);
  RangeMap other = makeMap(1);
  EXPECT_EQ(hashOf(map), hashOf(other));
  other.confidence.at<float>(0, 0) = 0.25F;
  EXPECT_NE(hashOf(map), hashOf(other));
}

TEST_F(RangeMapFileTest, MissingPartIsNamed) {
  const RangeMap map = makeMap(5);
  writeRangeMap(map, folder_);
  std::filesystem::remove(folder_ + "/left/5_sigma.tiff");
  try {
    readRangeMap(folder_, "left", map.stamp);
    FAIL();
  } catch (const InputError& error) {
    EXPECT_NE(std::string(error.what()).find("5_sigma.tiff"), std::string::npos);
  }
  EXPECT_THROW(listRangeMaps(folder_, "front"), InputError);
}

TEST_F(RangeMapFileTest, FilesThatAreNoRangeMapsAreNotListed) {
  const RangeMap map = makeMap(5);
  writeRangeMap(map, folder_);
  for (const std::string name : {"99999999999999999999.yaml", "5a.yaml", ".yaml", "6.tiff"}) {
    writeTextFileAtomically(folder_ + "/left/" + name, "");
  }
  EXPECT_EQ(listRangeMaps(folder_, "left"), std::vector<Timestamp>{map.stamp});
}

TEST(ColourRangeTest, NearIsRedFarIsBlueUnknownIsBlack) {
  cv::Mat range(1, 3, CV_32FC1);
  range.at<float>(0, 0) = 0.3F;
  range.at<float>(0, 1) = 50.0F;
  range.at<float>(0, 2) = std::numeric_limits<float>::quiet_NaN();
  const cv::Mat coloured = colourRange(range, 0.3, 50.0);
  const auto& near = coloured.at<cv::Vec3b>(0, 0);
  const auto& far = coloured.at<cv::Vec3b>(0, 1);
  EXPECT_GT(near[2], near[0]);
  EXPECT_GT(far[0], far[2]);
  EXPECT_EQ(coloured.at<cv::Vec3b>(0, 2), cv::Vec3b(0, 0, 0));
}

}  // namespace
}  // namespace vcharge
