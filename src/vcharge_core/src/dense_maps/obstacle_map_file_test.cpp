#include "vcharge_core/dense_maps/obstacle_map_file.h"

#include <cmath>
#include <filesystem>
#include <fstream>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "vcharge_core/base/error.h"

namespace vcharge {
namespace {

namespace fs = std::filesystem;

class ObstacleMapFileTest : public ::testing::Test {
 protected:
  ObstacleMapFileTest() {
    folder_ = (fs::temp_directory_path() /
               ("obstacle_map_file_test_" +
                std::string(::testing::UnitTest::GetInstance()->current_test_info()->name())))
                  .string();
    fs::remove_all(folder_);
    map_ = ObstacleMap::unobserved({5, 3}, 0.1);
    map_.stamp = Timestamp::fromNanoseconds(1342626148354042001);
    map_.frame_id = "odom";
    map_.fixed_from_vehicle = RigidTransform::planar(1.25, -2.5, 0.3);
    map_.origin_m = {-7.1, 3.2};
    map_.state.at<int8_t>(0, 4) = kCellOccupied;
    map_.state.at<int8_t>(2, 1) = kCellFree;
    map_.point_m.at<cv::Vec2f>(0, 4) = {0.43F, 0.07F};
    map_.point_sigma_m.at<float>(0, 4) = 0.03F;
    map_.height_m.at<float>(0, 4) = 0.6F;
    map_.height_sigma_m.at<float>(0, 4) = 0.02F;
    map_.age_s.at<float>(0, 4) = 0.5F;
    scans_ = {ObstacleScan::unknown(8, 10.0), ObstacleScan::unknown(4, 8.0)};
    scans_[0].name = "fused";
    scans_[1].name = "left";
    scans_[1].origin_m = {1.9, 0.98};
    for (ObstacleScan& scan : scans_) {
      scan.stamp = map_.stamp;
      scan.range_m[2] = 3.25F;
      scan.range_sigma_m[2] = 0.04F;
      scan.height_m[2] = 0.5F;
      scan.height_sigma_m[2] = 0.03F;
      scan.free_m[2] = 3.0F;
    }
  }
  ~ObstacleMapFileTest() override { fs::remove_all(folder_); }

  std::string file(const std::string& suffix) const {
    return folder_ + "/" + std::to_string(map_.stamp.nanoseconds()) + suffix;
  }

  std::string folder_;
  ObstacleMap map_;
  std::vector<ObstacleScan> scans_;
};

TEST_F(ObstacleMapFileTest, ReadsWhatItWrote) {
  writeObstacles(map_, scans_, folder_);
  ASSERT_THAT(listObstacles(folder_), ::testing::ElementsAre(map_.stamp));
  ContentHasher written, read;
  addToHash(map_, &written);
  addToHash(readObstacleMap(folder_, map_.stamp), &read);
  EXPECT_EQ(read.hex(), written.hex());
  const std::vector<ObstacleScan> scans = readObstacleScans(folder_, map_.stamp);
  ASSERT_EQ(scans.size(), 2U);
  EXPECT_EQ(scans[0].name, "fused");
  EXPECT_EQ(scans[1].size(), 4U);
  EXPECT_NEAR(scans[1].angle_min_rad, scans_[1].angle_min_rad, 1e-8);
  EXPECT_NEAR(scans[1].angle_increment_rad, scans_[1].angle_increment_rad, 1e-8);
  EXPECT_FLOAT_EQ(scans[1].range_m[2], 3.25F);
  EXPECT_FLOAT_EQ(scans[1].free_m[2], 3.0F);
  EXPECT_TRUE(std::isnan(scans[1].range_m[1]));
}

TEST_F(ObstacleMapFileTest, HashTellsEveryStateApart) {
  ContentHasher before, after;
  addToHash(map_, &before);
  map_.state.at<int8_t>(1, 1) = kCellFree;
  addToHash(map_, &after);
  EXPECT_NE(before.hex(), after.hex());
}

TEST_F(ObstacleMapFileTest, StampWithoutYamlIsNotListed) {
  writeObstacles(map_, scans_, folder_);
  fs::remove(file(".yaml"));
  EXPECT_TRUE(listObstacles(folder_).empty());
}

TEST_F(ObstacleMapFileTest, ErrorsNameTheFile) {
  const auto expectError = [](const std::function<void()>& run, const std::string& name) {
    try {
      run();
      ADD_FAILURE() << "no error for " << name;
    } catch (const InputError& error) {
      EXPECT_THAT(error.what(), ::testing::HasSubstr(name));
    }
  };
  expectError([&] { listObstacles(folder_ + "/none"); }, "none");
  writeObstacles(map_, scans_, folder_);
  fs::remove(file("_height.tiff"));
  expectError([&] { readObstacleMap(folder_, map_.stamp); }, "_height.tiff");
  std::ofstream(file("_scans.csv"), std::ios::app) << "left,1,2\n";
  expectError([&] { readObstacleScans(folder_, map_.stamp); }, "_scans.csv:14");
  std::ofstream(file("_scans.csv")) << "what,else\n";
  expectError([&] { readObstacleScans(folder_, map_.stamp); }, "header");
  std::ofstream(file(".yaml")) << "image: x.pgm\n";
  expectError([&] { readObstacleMap(folder_, map_.stamp); }, "stamp_ns");
}

}  // namespace
}  // namespace vcharge
