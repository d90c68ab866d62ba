#include "vcharge_ros/octomap_conversions.h"

#include <gtest/gtest.h>
#include <octomap/OcTree.h>
#include <octomap_msgs/BoundingBoxQuery.h>
#include <octomap_msgs/GetOctomap.h>
#include <octomap_msgs/OctomapWithPose.h>

#include "vcharge_core/base/error.h"

namespace vcharge {
namespace {

TEST(OctomapMessagesTest, HaveTheSumsOfThePublicPackage) {
  EXPECT_STREQ(ros::message_traits::md5sum<octomap_msgs::Octomap>(), "9a45536b45c5e409cd49f04bb2d9999f");
  EXPECT_STREQ(ros::message_traits::md5sum<octomap_msgs::OctomapWithPose>(),
               "20b380aca6a508a657e95526cddaf618");
  EXPECT_STREQ(ros::service_traits::md5sum<octomap_msgs::GetOctomap>(), "be9d2869d24fe40d6bc21ac21f6bb2c5");
  EXPECT_STREQ(ros::service_traits::md5sum<octomap_msgs::BoundingBoxQuery>(),
               "93aa3d73b866f04880927745f4aab303");
}

TEST(OctomapConversionsTest, KeepFreeOccupiedAndUnknownSpace) {
  octomap::OcTree tree(0.1);
  tree.updateNode(1.05, 0.05, 0.05, true);
  tree.updateNode(-0.55, 2.05, 0.35, false);
  tree.updateInnerOccupancy();
  const octomap_msgs::Octomap message = toMessage(tree, "map", Timestamp::fromNanoseconds(5));
  EXPECT_EQ(message.header.frame_id, "map");
  EXPECT_EQ(message.header.stamp.toNSec(), 5U);
  EXPECT_TRUE(message.binary);
  EXPECT_DOUBLE_EQ(message.resolution, 0.1);

  octomap::OcTree read(1.0);
  fromMessage(message, "/octomap", &read);
  ASSERT_NE(read.search(1.05, 0.05, 0.05), nullptr);
  EXPECT_TRUE(read.isNodeOccupied(read.search(1.05, 0.05, 0.05)));
  ASSERT_NE(read.search(-0.55, 2.05, 0.35), nullptr);
  EXPECT_FALSE(read.isNodeOccupied(read.search(-0.55, 2.05, 0.35)));
  EXPECT_EQ(read.search(3.0, 3.0, 0.0), nullptr);
}

TEST(OctomapConversionsTest, MarkerHasACubeForEachOccupiedVoxelAlsoWhereLeavesArePruned) {
  octomap::OcTree tree(0.1);
  for (int i = 0; i < 8; ++i) {
    tree.updateNode(0.05 + 0.1 * (i % 2), 0.05 + 0.1 * (i / 2 % 2), 0.05 + 0.1 * (i / 4), true);
  }
  tree.updateNode(3.05, 0.05, 0.05, false);
  tree.prune();
  ASSERT_EQ(tree.getNumLeafNodes(), 2U);
  const visualization_msgs::Marker marker = makeOctomapMarker(tree, "map", Timestamp::fromNanoseconds(0));
  ASSERT_EQ(marker.points.size(), 8U);
  EXPECT_EQ(marker.colors.size(), 8U);
  for (const geometry_msgs::Point& point : marker.points) {
    EXPECT_TRUE(tree.isNodeOccupied(tree.search(point.x, point.y, point.z)));
  }
  EXPECT_EQ(makeOctomapMarker(octomap::OcTree(0.1), "map", Timestamp::fromNanoseconds(0)).action,
            visualization_msgs::Marker::DELETE);
}

TEST(OctomapConversionsTest, KeepAnEmptyTree) {
  octomap::OcTree read(1.0);
  fromMessage(toMessage(octomap::OcTree(0.2), "map", Timestamp::fromNanoseconds(0)), "/octomap", &read);
  EXPECT_EQ(read.size(), 0U);
  EXPECT_DOUBLE_EQ(read.getResolution(), 0.2);
}

TEST(OctomapConversionsTest, RefuseWhatIsNoBinaryTree) {
  octomap::OcTree tree(0.1);
  octomap_msgs::Octomap message;
  message.binary = true;
  message.id = "ColorOcTree";
  message.resolution = 0.1;
  EXPECT_THROW(fromMessage(message, "/octomap", &tree), InputError);
  message.id = "OcTree";
  message.resolution = -0.1;
  EXPECT_THROW(fromMessage(message, "/octomap", &tree), InputError);
  message.resolution = 0.1;
  message.binary = false;
  EXPECT_THROW(fromMessage(message, "/octomap", &tree), InputError);
}

}  // namespace
}  // namespace vcharge
