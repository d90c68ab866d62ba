// Messages that the obstacle nodelet reads (range maps) and publishes (OctoMap).
#include "obstacle_messages.h"

#include <cmath>
#include <limits>

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <octomap/OcTree.h>

#include "corridor_messages.h"
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

TEST(CorridorMessageTest, HoldsBothDirectionsInTheVehicleFrame) {
  Corridor corridor;
  corridor.curvature_per_m = 0.1;
  corridor.outline = {3.75, -0.95, 1.15};
  corridor.forward.known_free_m = 2.0;
  corridor.forward.free_beyond_rim_m = 2.5;
  corridor.forward.occupied_m = 3.0;
  corridor.forward.unknown_fraction = 0.25;
  corridor.forward.oldest_age_s = 0.5;
  corridor.forward.crossing = CrossingObject{7, 1.5, 0.3};
  const Timestamp stamp = Timestamp::fromNanoseconds(5000000000LL);
  const vcharge_msgs::Corridor message = toMessage(corridor, stamp, "base_link");
  EXPECT_EQ(message.header.frame_id, "base_link");
  EXPECT_EQ(message.header.stamp.sec, 5U);
  EXPECT_EQ(message.curvature_per_m, 0.1);
  EXPECT_EQ(message.front_m, 3.75);
  EXPECT_EQ(message.rear_m, -0.95);
  EXPECT_EQ(message.half_width_m, 1.15);
  EXPECT_EQ(message.forward.known_free_m, 2.0);
  EXPECT_EQ(message.forward.free_beyond_rim_m, 2.5);
  EXPECT_EQ(message.forward.occupied_m, 3.0);
  EXPECT_EQ(message.forward.unknown_fraction, 0.25);
  EXPECT_EQ(message.forward.oldest_age_s, 0.5);
  EXPECT_TRUE(message.forward.has_crossing);
  EXPECT_EQ(message.forward.crossing_id, 7U);
  EXPECT_EQ(message.forward.crossing_time_s, 1.5);
  EXPECT_EQ(message.forward.crossing_travel_m, 0.3);
  EXPECT_EQ(message.backward.known_free_m, 0.0);
  EXPECT_EQ(message.backward.occupied_m, std::numeric_limits<double>::infinity());
  EXPECT_EQ(message.backward.unknown_fraction, 1.0);
  EXPECT_TRUE(std::isnan(message.backward.oldest_age_s));
  EXPECT_FALSE(message.backward.has_crossing);
}

TEST(CorridorMessageTest, StripsAreGreenThenYellowThenRedAlongTheArc) {
  Corridor corridor;
  corridor.curvature_per_m = 0.2;
  corridor.outline = {3.75, -0.95, 1.15};
  corridor.forward.known_free_m = 0.3;  // the ground of the rim is not seen
  corridor.forward.free_beyond_rim_m = 2.0;
  corridor.forward.occupied_m = 3.0;
  const auto markers = toMarkers(corridor, Timestamp::fromNanoseconds(5000000000LL), "base_link").markers;
  ASSERT_EQ(markers.size(), 2U);
  const visualization_msgs::Marker& forward = markers[0];
  EXPECT_EQ(forward.header.frame_id, "base_link");
  ASSERT_EQ(forward.points.size(), forward.colors.size());
  ASSERT_EQ(forward.points.size(), 6 * std::lround(kCorridorMarker_m / 0.1));
  for (size_t i = 0; i < forward.points.size(); ++i) {
    // Ends of the bumper keep their distances from the centre of the turn, (0, 5).
    const double radius_m = std::hypot(forward.points[i].x, forward.points[i].y - 5.0);
    const double inner_m = std::hypot(3.75, 5.0 - 1.15);
    const double outer_m = std::hypot(3.75, 5.0 + 1.15);
    EXPECT_NEAR(std::min(std::abs(radius_m - inner_m), std::abs(radius_m - outer_m)), 0.0, 1e-9);
    const size_t strip = i / 6;
    const double travel_m = 0.1 * static_cast<double>(strip) + 0.05;
    const bool is_free = travel_m < 0.3 || (travel_m > 0.6 && travel_m < 2.0);
    EXPECT_EQ(forward.colors[i].r, is_free ? 0.0F : 1.0F) << travel_m;
    EXPECT_EQ(forward.colors[i].g, travel_m < 3.0 ? 1.0F : 0.0F) << travel_m;
  }
  EXPECT_EQ(markers[1].colors.front().r, 1.0F);  // nothing is known to be free behind
  EXPECT_EQ(markers[1].colors.front().g, 1.0F);
}

}  // namespace
}  // namespace vcharge
