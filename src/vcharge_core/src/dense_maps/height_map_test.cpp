#include "vcharge_core/dense_maps/height_map.h"

#include <sys/resource.h>

#include <cmath>
#include <csignal>
#include <cstring>
#include <filesystem>
#include <fstream>
#include <limits>
#include <stdexcept>

#include <gtest/gtest.h>
#include <yaml-cpp/yaml.h>
#include <opencv2/imgcodecs.hpp>

#include "vcharge_core/base/error.h"
#include "vcharge_core/dense_maps/height_map_file.h"
#include "vcharge_core/files/file_io.h"

namespace vcharge {
namespace {

namespace fs = std::filesystem;
constexpr float kNan = std::numeric_limits<float>::quiet_NaN();

/// Level ground with a kerb from column 20 on, a hole, and a post.
HeightMap makeMap() {
  HeightMap map;
  map.origin_m = {-1.0, 2.0};
  map.cell_size_m = 0.05;
  map.height_m = cv::Mat(30, 40, CV_32FC1, cv::Scalar(0.0));
  map.height_m.colRange(20, 40).setTo(0.12F);
  map.height_m.at<float>(5, 5) = kNan;
  map.confidence = cv::Mat(30, 40, CV_32FC1, cv::Scalar(0.8));
  map.confidence.at<float>(5, 5) = 0.0F;
  map.gray = cv::Mat(30, 40, CV_8UC1, cv::Scalar(77));
  map.height_m.at<float>(5, 9) = kNan;
  map.solid = cv::Mat(30, 40, CV_8UC1, cv::Scalar(0));
  map.solid.at<uint8_t>(5, 9) = 255;
  return map;
}

std::string hashOf(const HeightMap& map) {
  ContentHasher hasher;
  addToHash(map, &hasher);
  return hasher.hex();
}

CellState stateOf(const cv::Mat& states, int row, int column) {
  return static_cast<CellState>(states.at<uint8_t>(row, column));
}

class HeightMapFileTest : public ::testing::Test {
 protected:
  void SetUp() override {
    folder_ = ::testing::TempDir() + "height_map_test";
    fs::remove_all(folder_);
    fs::create_directories(folder_);
  }
  void TearDown() override { fs::remove_all(folder_); }

  void expectError(const std::string& words) {
    try {
      readHeightMap(folder_);
      FAIL() << "expected an error with " << words;
    } catch (const InputError& error) {
      EXPECT_NE(std::string(error.what()).find(words), std::string::npos) << error.what();
    }
  }
  void replaceInYaml(const std::string& from, const std::string& to) {
    writeHeightMap(makeMap(), folder_ + "/height_map");
    std::string text = readTextFile(folder_ + "/height_map.yaml");
    const size_t at = text.find(from);
    ASSERT_NE(at, std::string::npos);
    writeTextFileAtomically(folder_ + "/height_map.yaml", text.replace(at, from.size(), to));
  }
  std::string folder_;
};

TEST(HeightMapTest, InterpolatesBetweenCentresAndNotBesideHoles) {
  const HeightMap map = makeMap();
  EXPECT_NEAR(interpolateHeight(map, map.centreOf(30, 10)), 0.12, 1e-6);
  EXPECT_NEAR(interpolateHeight(map, map.centreOf(19, 10) + Eigen::Vector2d(0.0125, 0.01)), 0.03, 1e-6);
  EXPECT_TRUE(std::isnan(interpolateHeight(map, map.centreOf(4, 4) + Eigen::Vector2d(0.01, 0.01))));
  EXPECT_TRUE(std::isnan(interpolateHeight(map, {-5.0, 2.0})));
  EXPECT_TRUE(std::isnan(interpolateHeight(map, {kNan, 2.0})));
}

TEST(HeightMapTest, KerbIsAnObstacleLevelGroundIsNotAndHolesAreUnknown) {
  const cv::Mat states = classifyCells(makeMap(), DrivabilityOptions());
  EXPECT_EQ(stateOf(states, 10, 19), CellState::kObstacle);
  EXPECT_EQ(stateOf(states, 10, 20), CellState::kObstacle);
  EXPECT_EQ(stateOf(states, 10, 10), CellState::kDrivable);
  EXPECT_EQ(stateOf(states, 10, 35), CellState::kDrivable);
  EXPECT_EQ(stateOf(states, 5, 5), CellState::kUnobserved);
}

TEST(HeightMapTest, WhatIsNotSureIsNotDrivableButMayBeAnObstacle) {
  HeightMap map = makeMap();
  map.confidence.at<float>(10, 10) = map.confidence.at<float>(10, 20) = 0.001F;
  const cv::Mat states = classifyCells(map, DrivabilityOptions());
  EXPECT_EQ(stateOf(states, 10, 10), CellState::kUnobserved);
  EXPECT_EQ(stateOf(states, 10, 11), CellState::kDrivable);
  EXPECT_EQ(stateOf(states, 10, 20), CellState::kObstacle);
  map.confidence = cv::Mat();
  EXPECT_EQ(stateOf(classifyCells(map, DrivabilityOptions()), 10, 10), CellState::kDrivable);
}

TEST(HeightMapTest, WhatStandsWithoutAHeightIsAnObstacle) {
  HeightMap map = makeMap();
  EXPECT_EQ(stateOf(classifyCells(map, DrivabilityOptions()), 5, 9), CellState::kObstacle);
  map.solid = cv::Mat();
  EXPECT_EQ(stateOf(classifyCells(map, DrivabilityOptions()), 5, 9), CellState::kUnobserved);
  EXPECT_NE(hashOf(map), hashOf(makeMap()));
}

TEST(HeightMapTest, RampIsDrivableUntilItIsTooSteep) {
  HeightMap map = makeMap();
  for (const double slope : {0.15, 0.35}) {
    for (int row = 0; row < map.height_m.rows; ++row) {
      for (int column = 0; column < map.height_m.cols; ++column) {
        map.height_m.at<float>(row, column) = static_cast<float>(slope * map.cell_size_m * column);
      }
    }
    EXPECT_EQ(stateOf(classifyCells(map, DrivabilityOptions()), 15, 20),
              slope < 0.25 ? CellState::kDrivable : CellState::kObstacle);
  }
}

TEST(HeightMapTest, OptionsNameTheirField) {
  DrivabilityOptions options;
  options.max_slope = -1.0;
  try {
    classifyCells(makeMap(), options);
    FAIL();
  } catch (const std::invalid_argument& error) {
    EXPECT_NE(std::string(error.what()).find("max_slope"), std::string::npos);
  }
}

TEST_F(HeightMapFileTest, SurvivesWritingAndReadingExactly) {
  writeHeightMap(makeMap(), folder_ + "/height_map");
  EXPECT_EQ(hashOf(readHeightMap(folder_)), hashOf(makeMap()));
  EXPECT_EQ(hashOf(readHeightMap(folder_ + "/height_map.yaml")), hashOf(makeMap()));
}

TEST_F(HeightMapFileTest, ErrorsNameFileAndKey) {
  expectError("height_map.yaml");
  replaceInYaml("cell_size_m: 0.05", "cell_size_m: -1 #");
  expectError("height_map.yaml: cell_size_m");
  replaceInYaml("origin_m: [", "origin_m: [.nan, 0] # [");
  expectError("height_map.yaml: origin_m");
  replaceInYaml("size_cells: [40, 30]", "size_cells: [41, 30]");
  expectError("height_map.tiff: expected a TIFF of 32-bit floats of 41 x 30 cells");
  replaceInYaml("frame: ", "frames: ");
  expectError("height_map.yaml: frame");
  writeHeightMap(makeMap(), folder_ + "/height_map");
  fs::resize_file(folder_ + "/height_map_gray.png", 20);
  expectError("height_map_gray.png");
  writeHeightMap(makeMap(), folder_ + "/height_map");
  fs::remove(folder_ + "/height_map_solid.png");
  expectError("height_map_solid.png");
}

TEST_F(HeightMapFileTest, OccupancyPictureHasTheMapServersValuesNorthUp) {
  const HeightMap map = makeMap();
  writeOccupancyMap(map, classifyCells(map, DrivabilityOptions()), folder_ + "/drivable");
  const cv::Mat picture = cv::imread(folder_ + "/drivable.pgm", cv::IMREAD_UNCHANGED);
  ASSERT_EQ(picture.size(), map.height_m.size());
  EXPECT_EQ(picture.at<uint8_t>(29 - 5, 5), 205);
  EXPECT_EQ(picture.at<uint8_t>(29 - 10, 10), 254);
  EXPECT_EQ(picture.at<uint8_t>(29 - 10, 20), 0);
  const YAML::Node yaml = YAML::LoadFile(folder_ + "/drivable.yaml");
  EXPECT_EQ(yaml["image"].as<std::string>(), "drivable.pgm");
  EXPECT_DOUBLE_EQ(yaml["origin"][0].as<double>(), -1.025);
  EXPECT_DOUBLE_EQ(yaml["resolution"].as<double>(), 0.05);
}

TEST_F(HeightMapFileTest, MeshHasAVertexForEachObservedCell) {
  writeHeightMapMesh(makeMap(), folder_ + "/mesh.ply");
  const std::string text = readTextFile(folder_ + "/mesh.ply");
  EXPECT_NE(text.find("element vertex 1198\n"), std::string::npos);
  EXPECT_NE(text.find("element face " + std::to_string(2 * (29 * 39 - 8)) + "\n"), std::string::npos);
  const size_t body = text.find("end_header\n") + std::strlen("end_header\n");
  EXPECT_EQ(text.size() - body, 1198U * 15 + 2U * (29 * 39 - 8) * 13);
  float first[3];
  std::memcpy(first, text.data() + body, sizeof(first));
  EXPECT_FLOAT_EQ(first[0], -1.0F);
  EXPECT_FLOAT_EQ(first[1], 2.0F);
}

TEST_F(HeightMapFileTest, LeavesNothingOnAFullDisk) {
  std::signal(SIGXFSZ, SIG_IGN);
  rlimit old{};
  getrlimit(RLIMIT_FSIZE, &old);
  rlimit small = old;
  small.rlim_cur = 200;
  setrlimit(RLIMIT_FSIZE, &small);
  EXPECT_THROW(writeHeightMap(makeMap(), folder_ + "/height_map"), InputError);
  EXPECT_THROW(writeHeightMapMesh(makeMap(), folder_ + "/mesh.ply"), InputError);
  setrlimit(RLIMIT_FSIZE, &old);
  EXPECT_TRUE(fs::is_empty(folder_));
}

}  // namespace
}  // namespace vcharge
