#include <cmath>
#include <cstring>
#include <limits>
#include <memory>
#include <vector>

#include <gtest/gtest.h>
#include <tbb/global_control.h>

#include "height_map/regularization/height_regularization.h"
#include "height_map/test_views.h"
#include "vcharge_core/base/error.h"

namespace vcharge {
namespace {

using testing::BoxWorld;

const double kGamma = HeightMapOptions().label_gamma;

/// Cameras that drive along x on both sides of a box and face it.
struct Drive {
  BoxWorld world;
  std::vector<RigidTransform> poses;
  std::vector<Eigen::Vector3d> positions;
  std::vector<std::shared_ptr<const PackedRangeMap>> maps;
  HeightFusionOptions options;
  VoxelGrid grid;

  /// `matched_up_to_m`: points above this height have no range, like unstructured paint.
  explicit Drive(double noise_m = 0.0, const BoxWorld& box = BoxWorld(),
                 double matched_up_to_m = std::numeric_limits<double>::infinity())
      : world(box) {
    options.max_range_m = 4.0;
    cv::RNG random(5);
    for (int i = 0; i < 14; ++i) {
      for (const double side : {-1.0, 1.0}) {
        const Eigen::Vector3d position(0.4 * i, side * -2.0, 1.0);
        poses.push_back(testing::cameraPose(position, side * 1.57, 0.6));
        positions.push_back(position);
        RangeMap map = testing::renderView(world, poses.back(), cv::Size(320, 200));
        leaveOut(matched_up_to_m, &map);
        cv::Mat noise(map.range_m.size(), CV_32FC1);
        random.fill(noise, cv::RNG::NORMAL, 0.0, noise_m > 0.0 ? noise_m : 1e-12);
        map.range_m += noise;
        map.standard_deviation_m.setTo(std::max(0.01, noise_m));
        maps.push_back(std::make_shared<const PackedRangeMap>(packRangeMap(map, poses.back())));
      }
    }
    Eigen::AlignedBox3d extent_m;
    for (const Eigen::Vector3d& position : positions) {
      extent_m.extend(Eigen::Vector3d(position.x(), position.y(), 0.0));
    }
    grid = makeVoxelGrid(extent_m, options);
  }

  void leaveOut(double matched_up_to_m, RangeMap* map) const {
    for (int y = 0; y < map->range_m.rows; ++y) {
      for (int x = 0; x < map->range_m.cols; ++x) {
        float& range = map->range_m.at<float>(y, x);
        const Eigen::Vector3d ray = poses.back().rotation() * testing::rayOf(*map, x, y);
        if (positions.back().z() + range * ray.z() > matched_up_to_m) {
          range = std::nanf("");
        }
      }
    }
  }

  ColumnImages fuse() const {
    return fuseColumns(grid, positions, [this](size_t view) { return maps[view]; }, options, {});
  }
};

Eigen::Vector2d centreOf(const VoxelGrid& grid, int column, int row) {
  return grid.origin_m + grid.cell_size_m * Eigen::Vector2d(column, row);
}

/// Whether the true height is constant around a cell's centre.
bool isLevel(const BoxWorld& world, const Eigen::Vector2d& point) {
  for (const double dx : {-0.06, 0.06}) {
    for (const double dy : {-0.06, 0.06}) {
      if (world.heightAt(point.x() + dx, point.y() + dy) != world.heightAt(point.x(), point.y())) {
        return false;
      }
    }
  }
  return true;
}

/// Calls judge(cell, true height) for the cells around the box that all cameras pass, away from its edges.
template <class Judge>
void forEachLevelCell(const Drive& drive, const Judge& judge) {
  for (int row = 0; row < drive.grid.rows; ++row) {
    for (int column = 0; column < drive.grid.columns; ++column) {
      const Eigen::Vector2d centre = centreOf(drive.grid, column, row);
      if (centre.x() < 0.5 || centre.x() > 4.5 || std::abs(centre.y()) > 1.5 ||
          !isLevel(drive.world, centre)) {
        continue;
      }
      const double truth = drive.world.heightAt(centre.x(), centre.y());
      judge(cv::Point(column, row), truth);
    }
  }
}

TEST(HeightFusionTest, FindsGroundAndBoxWithinAVoxel) {
  const Drive drive;
  const ColumnImages columns = drive.fuse();
  int num_ground = 0, num_box = 0;
  forEachLevelCell(drive, [&](const cv::Point& cell, double truth) {
    EXPECT_NEAR(columns.best_height_m.at<float>(cell), truth, drive.grid.height_step_m + 1e-4) << cell;
    EXPECT_GT(columns.support_below.at<float>(cell), 0.5F);
    EXPECT_GT(columns.support_above.at<float>(cell), 0.5F);
    ++(truth > 0.0 ? num_box : num_ground);
  });
  EXPECT_GT(num_box, 250);
  EXPECT_GT(num_ground, 3000);
}

TEST(HeightFusionTest, SmoothedHeightsOfNoisyRangesAreFlatAndKeepTheEdge) {
  const Drive drive(0.08);
  const ColumnImages columns = drive.fuse();
  PrimalDualReport report;
  const cv::Mat observed = labelObserved(columns, kGamma, &report);
  EXPECT_TRUE(report.converged);
  const cv::Mat heights = smoothHeights(columns, observed, drive.grid, &report);
  EXPECT_TRUE(report.converged);
  double sum = 0.0;
  int num = 0;
  forEachLevelCell(drive, [&](const cv::Point& cell, double truth) {
    ASSERT_TRUE(std::isfinite(heights.at<float>(cell))) << cell;
    sum += std::abs(heights.at<float>(cell) - truth);
    ++num;
  });
  EXPECT_LT(sum / num, 0.0125);  // half a voxel
  EXPECT_GT(num, 3000);
}

TEST(HeightFusionTest, MapsABodyUnderWhichTheGroundIsVisible) {
  BoxWorld car;
  car.low.z() = 0.35;
  car.high.z() = 1.4;
  Drive drive(0.0, car, 0.5);
  const auto cellOf = [&](const Eigen::Vector2d& point) {
    const Eigen::Vector2d cell = (point - drive.grid.origin_m) / drive.grid.cell_size_m;
    return cv::Point(static_cast<int>(std::lround(cell.x())), static_cast<int>(std::lround(cell.y())));
  };
  const ColumnImages layered = drive.fuse();
  drive.options.min_layer_weight_m = 1e9;
  const ColumnImages single = drive.fuse();
  PrimalDualReport report;
  const cv::Mat heights =
      smoothHeights(layered, labelObserved(layered, kGamma, &report), drive.grid, &report);
  for (const double side : {-1.0, 1.0}) {
    for (double x = 2.1; x < 2.9; x += 0.1) {
      const cv::Point inside = cellOf({x, side * 0.45}), before = cellOf({x, side * 0.6});
      EXPECT_NEAR(single.best_height_m.at<float>(inside), 0.0, 0.03) << x;
      EXPECT_GT(layered.best_height_m.at<float>(inside), 0.45) << x;
      EXPECT_LT(layered.best_height_m.at<float>(inside), 0.6) << x;
      // Nothing above was observed: only the support from below keeps the height.
      EXPECT_GT(layered.support_below.at<float>(inside), 0.5F) << x;
      EXPECT_LT(layered.support_above.at<float>(inside), 0.1F) << x;
      EXPECT_GT(heights.at<float>(inside), 0.4) << x;
      EXPECT_NEAR(heights.at<float>(before), 0.0, 0.03) << x;
    }
  }
}

TEST(HeightFusionTest, PillarIsSolidAndTheGroundIsNot) {
  BoxWorld pillar;
  pillar.high.z() = 5.0;  // reaches out of the grid
  const Drive drive(0.02, pillar);
  const ColumnImages columns = drive.fuse();
  PrimalDualReport report;
  const cv::Mat observed = labelObserved(columns, kGamma, &report);
  int num_faces = 0, num_open = 0;
  for (int row = 0; row < drive.grid.rows; ++row) {
    for (int column = 0; column < drive.grid.columns; ++column) {
      const Eigen::Vector2d centre = centreOf(drive.grid, column, row);
      const double outside_m = std::max(std::abs(centre.x() - 2.5), std::abs(centre.y())) - 0.5;
      const bool is_solid = columns.solid.at<uint8_t>(row, column) != 0;
      if (outside_m > 0.05) {
        EXPECT_FALSE(is_solid) << centre.transpose();
        ++num_open;
      } else if (std::abs(centre.x() - 2.5) < 0.3 && outside_m < -0.01 && outside_m > -0.1) {
        EXPECT_TRUE(is_solid) << centre.transpose();  // only the faces that the cameras pass
        EXPECT_EQ(observed.at<uint8_t>(row, column), 0) << centre.transpose();
        ++num_faces;
      }
    }
  }
  EXPECT_GT(num_faces, 20);
  EXPECT_GT(num_open, 10000);
}

TEST(HeightFusionTest, CellsThatNoViewSeesAreNotObserved) {
  const Drive drive;
  PrimalDualReport report;
  const cv::Mat observed = labelObserved(drive.fuse(), kGamma, &report);
  EXPECT_EQ(observed.at<uint8_t>(0, 0), 0);
  EXPECT_EQ(observed.at<uint8_t>(drive.grid.rows - 1, drive.grid.columns - 1), 0);
  EXPECT_GT(cv::countNonZero(observed), 5000);
}

TEST(HeightFusionTest, RangesThatAreNotFiniteChangeNothing) {
  const Drive drive;
  Drive other;
  int number = 0;
  for (const float value : {std::nanf(""), std::numeric_limits<float>::infinity(), 0.0F, -1.0F}) {
    for (const bool in_sigma : {false, true}) {
      // Adds a corrupt view of ground beside the box that other views show too.
      const RigidTransform pose = other.poses[static_cast<size_t>(8 + number++)];
      RangeMap map = testing::renderView(other.world, pose, cv::Size(320, 200));
      (in_sigma ? map.standard_deviation_m : map.range_m).setTo(value);
      other.maps.push_back(std::make_shared<const PackedRangeMap>(packRangeMap(map, pose)));
      other.positions.push_back(pose.translation());
    }
  }
  const cv::Mat expected = drive.fuse().best_height_m, actual = other.fuse().best_height_m;
  EXPECT_EQ(std::memcmp(expected.data, actual.data, expected.total() * sizeof(float)), 0);
}

TEST(HeightFusionTest, IsTheSameOnAnyNumberOfThreads) {
  const Drive drive(0.02);
  cv::Mat heights[2];
  for (int i = 0; i < 2; ++i) {
    const tbb::global_control threads(tbb::global_control::max_allowed_parallelism, i == 0 ? 1 : 4);
    heights[i] = drive.fuse().best_height_m;
  }
  EXPECT_EQ(std::memcmp(heights[0].data, heights[1].data, heights[0].total() * sizeof(float)), 0);
}

TEST(HeightFusionTest, RefusesAGridThatTakesTooMuchMemory) {
  const auto refuse = [](const Eigen::Vector3d& high_m) {
    makeVoxelGrid(Eigen::AlignedBox3d(Eigen::Vector3d::Zero(), high_m), HeightFusionOptions());
  };
  try {
    refuse({90000, 70000, 1});
    FAIL() << "expected an error";
  } catch (const InputError& error) {
    EXPECT_NE(std::string(error.what()).find("max_memory_gb"), std::string::npos);
    EXPECT_NE(std::string(error.what()).find("GB"), std::string::npos);
  }
  EXPECT_THROW(refuse({1e300, 0, 1}), InputError);
  EXPECT_THROW(refuse({0, 0, 1e12}), InputError);
}

}  // namespace
}  // namespace vcharge
