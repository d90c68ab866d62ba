#include "vcharge_recordings/drive_bag_writer.h"

#include <set>

#include <rosbag/bag.h>
#include <rosbag/view.h>
#include <sensor_msgs/CameraInfo.h>

#include "vcharge_core/files/file_io.h"
#include "vcharge_ros/camera_info.h"
#include "vcharge_ros/conversions.h"
#include "vcharge_ros/test_support.h"

namespace vcharge {
namespace {

using testing::expectInputError;
using testing::milliseconds;

const cv::Size kSize(32, 20);

std::set<std::string> filesIn(const std::string& folder) {
  std::set<std::string> names;
  for (const auto& entry : std::filesystem::directory_iterator(folder)) {
    names.insert(entry.path().filename().string());
  }
  return names;
}

TEST(DriveBagWriterTest, WritesTheStandardTopicsAtTheirStamps) {
  const testing::ScratchFolder folder;
  const CameraRig rig = testing::makeRig(kSize);
  DriveBagWriter writer(folder / "drive.bag", rig);
  const VehicleOdometry odometry{milliseconds(10), RigidTransform::planar(1, 2, 3), 0.5, 0.1};
  writer.writeImage(1, milliseconds(10), cv::Mat::zeros(kSize, CV_8UC1));
  writer.writeOdometry(odometry);
  writer.writeWheelTicks({milliseconds(10), 3, 4, 0.01, 0.2});
  writer.writeGroundTruth(odometry);
  writer.writeTrueObjects(milliseconds(10), {TrackedObject()});
  writer.close();

  rosbag::Bag bag(folder / "drive.bag");
  std::set<std::string> topics;
  for (const rosbag::MessageInstance& message : rosbag::View(bag)) {
    EXPECT_EQ(toTimestamp(message.getTime()), milliseconds(10));
    topics.insert(message.getTopic() + " " + message.getDataType());
    if (const auto truth = message.instantiate<nav_msgs::Odometry>();
        truth && message.getTopic() == "/ground_truth") {
      EXPECT_EQ(truth->header.frame_id, "world");
      EXPECT_EQ(truth->child_frame_id, "base_link");
    }
    if (const auto info = message.instantiate<sensor_msgs::CameraInfo>()) {
      EXPECT_EQ(toTimestamp(info->header.stamp), milliseconds(10));
      EXPECT_EQ(info->K, makeCameraInfo(rig.cameras[1]).K);
    }
  }
  EXPECT_EQ(topics,
            (std::set<std::string>{
                "/camera/left/image_raw sensor_msgs/Image", "/camera/left/camera_info sensor_msgs/CameraInfo",
                "/odom nav_msgs/Odometry", "/wheel_ticks vcharge_msgs/WheelTicks",
                "/ground_truth nav_msgs/Odometry", "/ground_truth/objects vcharge_msgs/TrackedObjects"}));
}

TEST(DriveBagWriterTest, ShowsTheBagOnlyOnceItIsClosed) {
  const testing::ScratchFolder folder;
  DriveBagWriter writer(folder / "drive.bag", testing::makeRig(kSize));
  writer.writeImage(0, milliseconds(10), cv::Mat::zeros(kSize, CV_8UC1));
  EXPECT_EQ(filesIn(folder.path()).count("drive.bag"), 0u);
  writer.close();
  EXPECT_EQ(filesIn(folder.path()), (std::set<std::string>{"drive.bag"}));
}

TEST(DriveBagWriterTest, LeavesNothingBehindWhenItIsNotClosed) {
  const testing::ScratchFolder folder;
  writeTextFileAtomically(folder / "drive.bag", "an earlier drive");
  {
    DriveBagWriter writer(folder / "drive.bag", testing::makeRig(kSize));
    writer.writeImage(0, milliseconds(10), cv::Mat::zeros(kSize, CV_8UC1));
  }
  EXPECT_EQ(filesIn(folder.path()), (std::set<std::string>{"drive.bag"}));
  EXPECT_EQ(readTextFile(folder / "drive.bag"), "an earlier drive");
}

TEST(DriveBagWriterTest, SameDriveGivesSameBytes) {
  const testing::ScratchFolder folder;
  for (const std::string name : {"first.bag", "second.bag"}) {
    DriveBagWriter writer(folder / name, testing::makeRig(kSize));
    for (int i = 0; i < 5; ++i) {
      writer.writeOdometry({milliseconds(80 * i), RigidTransform::planar(i, 0, 0), 1, 0});
      writer.writeImage(i % 2, milliseconds(80 * i), cv::Mat(kSize, CV_8UC1, cv::Scalar(i)));
    }
    writer.close();
  }
  EXPECT_EQ(readTextFile(folder / "first.bag"), readTextFile(folder / "second.bag"));
}

TEST(DriveBagWriterTest, NamesAFolderItCannotWrite) {
  expectInputError([] { DriveBagWriter("/proc/folder/drive.bag", testing::makeRig(kSize)); },
                   {"/proc/folder", "cannot be created"});
  const testing::ScratchFolder folder;
  expectInputError([&] { DriveBagWriter(folder.path(), testing::makeRig(kSize)); },
                   {folder.path(), "it is a folder"});
}

TEST(DriveBagWriterTest, RefusesImagesUnlikeTheRig) {
  const testing::ScratchFolder folder;
  DriveBagWriter writer(folder / "drive.bag", testing::makeRig(kSize));
  EXPECT_THROW(writer.writeImage(0, milliseconds(10), cv::Mat::zeros(20, 16, CV_8UC1)), std::logic_error);
  EXPECT_THROW(writer.writeImage(2, milliseconds(10), cv::Mat::zeros(kSize, CV_8UC1)), std::out_of_range);
}

}  // namespace
}  // namespace vcharge
