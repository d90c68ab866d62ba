// Messages that the obstacle nodelet reads (range maps) and publishes (OctoMap).
#include "obstacle_messages.h"

#include <cmath>
#include <functional>
#include <limits>

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <octomap/OcTree.h>

#include "detection/box_world.h"
#include "range_map_reader.h"
#include "vcharge_core/base/error.h"
#include "vcharge_ros/range_map_conversions.h"

namespace vcharge {
namespace {

/// Messages that depth_nodelet would publish for one camera.
class RangeMapReaderTest : public ::testing::Test {
 protected:
  RangeMapReaderTest() : converter_(camera_.field_of_view_rad) {
    RangeMapMessages messages =
        converter_.convert(map_, cv::Mat(map_.range_m.size(), CV_8UC1, cv::Scalar(77)));
    range_ = messages.range;
    sigma_ = messages.standard_deviation;
    confidence_ = messages.confidence;
    reference_ = messages.reference;
    info_ = messages.camera_info;
  }
  RangeMap read() {
    RangeMapReader reader(camera_, "/dense/left/range");
    return reader.read({range_, sigma_, confidence_, reference_, info_});
  }
  void expectError(const std::vector<std::string>& words) {
    try {
      read();
      ADD_FAILURE() << "expected an error";
    } catch (const InputError& error) {
      for (const std::string& word : words) {
        EXPECT_THAT(error.what(), ::testing::HasSubstr(word));
      }
    }
  }

  const RigCamera camera_ = makeBoxWorldRig().cameras[1];
  const RangeMap map_ = measureBoxWorld({}, camera_, RigidTransform(),
                                        Timestamp::fromNanoseconds(5000000000LL), {0.01, 0.1, 1});
  RangeMapConverter converter_;
  sensor_msgs::ImagePtr range_, sigma_, confidence_, reference_;
  sensor_msgs::CameraInfoPtr info_;
};

TEST_F(RangeMapReaderTest, RestoresThePublishedRangeMap) {
  const RangeMap map = read();
  ContentHasher expected, got;
  addToHash(map_, &expected);
  addToHash(map, &got);
  EXPECT_EQ(got.hex(), expected.hex());
  EXPECT_EQ(map.camera_name, camera_.name);
  EXPECT_EQ(cv::countNonZero(map.reference == 77), map.range_m.rows * map.range_m.cols);
}

TEST_F(RangeMapReaderTest, RefusesAnotherCameraAndNamesTheTopic) {
  const sensor_msgs::CameraInfo valid = *info_;
  info_->K[0] *= 1.01;
  expectError({"/dense/left/range/camera_info", "expected camera 'left'"});
  *info_ = valid;
  info_->D[0] += 0.01;
  expectError({"/dense/left/range/camera_info"});
  *info_ = valid;
  info_->header.frame_id = "camera_right_optical";
  expectError({"/dense/left/range/camera_info", "camera_right_optical"});
  *info_ = valid;
  info_->width += 1;
  expectError({"/dense/left/range/camera_info"});
  *info_ = valid;
  EXPECT_NO_THROW(read());
}

TEST_F(RangeMapReaderTest, RefusesImagesOfOtherSizesOrEncodings) {
  sigma_->encoding = "mono8";
  expectError({"/dense/left/range/standard_deviation", "32FC1", "mono8"});
  sigma_->encoding = "32FC1";
  sigma_->height -= 1;
  sigma_->data.resize(sigma_->data.size() - sigma_->step);
  expectError({"/dense/left/range", "one size"});
  range_->height -= 1;
  range_->data.resize(range_->data.size() - range_->step);
  expectError({"/dense/left/range/image", "aspect ratio of camera 'left'"});
}

TEST(ToOctreeTest, VoxelsHaveThePositionsAndStatesOfTheCells) {
  ObstacleMap map = ObstacleMap::unobserved({4, 3}, 0.1);
  map.origin_m = {-0.2, 5.0};
  map.state.at<int8_t>(0, 1) = kCellFree;
  map.state.at<int8_t>(2, 3) = kCellOccupied;
  map.height_m.at<float>(2, 3) = 0.35F;
  const auto tree = toOctree(map);
  const auto stateAt = [&](double x, double y, double z) {
    const octomap::OcTreeNode* node = tree->search(x, y, z);
    return node == nullptr ? kCellUnobserved : tree->isNodeOccupied(node) ? kCellOccupied : kCellFree;
  };
  for (int row = 0; row < 3; ++row) {
    for (int column = 0; column < 4; ++column) {
      EXPECT_EQ(stateAt(-0.15 + 0.1 * column, 5.05 + 0.1 * row, 0.05), map.state.at<int8_t>(row, column));
    }
  }
  EXPECT_EQ(stateAt(-0.05, 5.05, 0.15), kCellUnobserved);  // nothing is known above free ground
  EXPECT_EQ(stateAt(0.15, 5.25, 0.35), kCellOccupied);
  EXPECT_EQ(stateAt(0.15, 5.25, 0.45), kCellUnobserved);
}

}  // namespace
}  // namespace vcharge
