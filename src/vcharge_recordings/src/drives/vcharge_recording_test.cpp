#include "vcharge_recordings/vcharge_recording.h"

#include <cmath>
#include <cstdlib>

#include <opencv2/imgcodecs.hpp>

#include "vcharge_core/files/file_io.h"
#include "vcharge_ros/test_support.h"

namespace vcharge {
namespace {

using testing::expectInputError;

constexpr char kCalibration[] =
    "895 0 19.5 894 9.5 1.15 -0.33 0.086 -0.0006 -0.00003\n\n1 0 0 1.9\n0 0 1 1.4\n0 -1 0 0.067\n";

class VchargeRecordingTest : public ::testing::Test {
 protected:
  VchargeRecordingTest() {
    writeTextFileAtomically(folder_ / "calib.txt", kCalibration);
    writeTextFileAtomically(folder_ / "images.txt", "mono_left_1000000.png\nmono_left_1080000.png\n");
    for (const std::string name : {"mono_left_1000000.png", "mono_left_1080000.png"}) {
      cv::imwrite(folder_ / name, cv::Mat::zeros(20, 40, CV_8UC1));
    }
    // Poses of 0.5 s at 2 m/s along the world's y (yaw 90 degrees), turning at 0.1 rad/s.
    std::string poses = "# comment\n";
    for (int i = 0; i <= 20; ++i) {
      const double t = 0.04 * i;
      poses += std::to_string(800000 + 40000 * i) + " " + std::to_string(M_PI / 2 + 0.1 * t) + " 0 0 5 " +
               std::to_string(2.0 * t) + " 0\n";
    }
    writeTextFileAtomically(folder_ / "system_poses.txt", poses);
  }

  const testing::ScratchFolder folder_;
};

TEST_F(VchargeRecordingTest, PutsBaseLinkOnTheGround) {
  VchargeRecordingOptions options;
  options.ground_height_m = -0.832;
  options.ground_slope_x = 0.02;
  options.ground_slope_y = -0.03;
  const VchargeRecording recording = readVchargeRecording(folder_.path(), options);
  ASSERT_EQ(recording.rig.cameras.size(), 1u);
  const RigCamera& camera = recording.rig.cameras[0];
  EXPECT_EQ(camera.name, "left");
  EXPECT_EQ(camera.frame_id, "camera_left_optical");
  EXPECT_EQ(camera.image_size_px, cv::Size(40, 20));
  // The camera's height is its distance from the plane z = h + a x + b y.
  const Eigen::Vector3d in_system(1.9, 1.4, 0.067);
  const double height = (in_system.z() - (-0.832 + 0.02 * in_system.x() - 0.03 * in_system.y())) /
                        std::sqrt(1.0 + 0.02 * 0.02 + 0.03 * 0.03);
  EXPECT_NEAR(camera.vehicle_from_camera->translation().z(), height, 1e-12);
}

TEST_F(VchargeRecordingTest, LeavesTheCamerasPathInTheWorldAsItWas) {
  const VchargeRecording recording = readVchargeRecording(folder_.path());
  const VehicleOdometry& pose = recording.odometry.front();  // 800000 us
  const RigidTransform world_from_camera =
      pose.odom_from_vehicle * *recording.rig.cameras[0].vehicle_from_camera;
  // world_from_system (yaw 90 degrees at (5, 0, 0)) times (1.9, 1.4, 0.067).
  EXPECT_LT((world_from_camera.translation() - Eigen::Vector3d(5.0 - 1.4, 1.9, 0.067)).norm(), 1e-5);
  // The optical axis is the system's y, which is the world's -x.
  EXPECT_LT((world_from_camera.rotation() * Eigen::Vector3d::UnitZ() + Eigen::Vector3d::UnitX()).norm(),
            1e-5);
}

TEST_F(VchargeRecordingTest, DerivesVelocitiesFromThePoses) {
  const VchargeRecording recording = readVchargeRecording(folder_.path());
  ASSERT_GE(recording.odometry.size(), 15u);
  for (const VehicleOdometry& pose : recording.odometry) {
    EXPECT_NEAR(pose.forward_speed_m_per_s, 2.0, 0.01);  // the heading drifts off the path by up to 0.08 rad
    EXPECT_NEAR(pose.yaw_rate_rad_per_s, 0.1, 1e-4);
  }
}

TEST_F(VchargeRecordingTest, RefusesOptionsOutOfRange) {
  for (const std::string name : {"", "left mirror", "../left", "1left"}) {
    VchargeRecordingOptions options;
    options.camera_name = name;
    EXPECT_THROW(readVchargeRecording(folder_.path(), options), std::invalid_argument) << name;
  }
}

TEST_F(VchargeRecordingTest, NamesWhatIsWrong) {
  writeTextFileAtomically(folder_ / "images.txt", "mono_left_1000000.png\nmono_left_9080000.png\n");
  expectInputError([&] { readVchargeRecording(folder_.path()); }, {"system_poses.txt", "9.08"});
  writeTextFileAtomically(folder_ / "images.txt", "mono_left_1080000.png\nmono_left_1000000.png\n");
  expectInputError([&] { readVchargeRecording(folder_.path()); }, {"images.txt:2", "increase"});
  writeTextFileAtomically(folder_ / "images.txt", "left.png\n");
  expectInputError([&] { readVchargeRecording(folder_.path()); }, {"images.txt:1", "microseconds"});
  writeTextFileAtomically(folder_ / "images.txt", "mono_left_1000001.png\n");
  expectInputError([&] { readVchargeRecording(folder_.path()); },
                   {"mono_left_1000001.png", "expected an image"});
  writeTextFileAtomically(folder_ / "system_poses.txt", "1 2 3\n");
  expectInputError([&] { readVchargeRecording(folder_.path()); }, {"system_poses.txt:1", "yaw pitch roll"});
  writeTextFileAtomically(folder_ / "calib.txt", "1 2 3\n");
  expectInputError([&] { readVchargeRecording(folder_.path()); }, {"calib.txt", "skew"});
}

TEST(VchargeRecordingDataTest, ReadsThePublishedImages) {
  const char* data = std::getenv("VCHARGE_DATA");
  if (data == nullptr) {
    GTEST_SKIP() << "VCHARGE_DATA is not set: the published V-Charge images are not there";
  }
  const VchargeRecording recording = readVchargeRecording(std::string(data) + "/vcharge_left");
  EXPECT_EQ(recording.images.size(), 25u);
  const RigCamera& camera = recording.rig.cameras.at(0);
  EXPECT_EQ(camera.image_size_px, cv::Size(1280, 800));
  // According to the description of the data, the camera is 0.90 m above the ground.
  EXPECT_NEAR(camera.vehicle_from_camera->translation().z(), 0.90, 0.01);
  // The mirror's camera looks to the left and down.
  const Eigen::Vector3d axis = camera.vehicle_from_camera->rotation() * Eigen::Vector3d::UnitZ();
  EXPECT_GT(axis.y(), 0.5);
  EXPECT_LT(axis.z(), -0.5);
  // The car's body is masked, the ground beside it and the horizon are not.
  EXPECT_EQ(camera.mask.at<uint8_t>(760, 1100), 0);
  EXPECT_EQ(camera.mask.at<uint8_t>(500, 640), 255);
  EXPECT_EQ(camera.mask.at<uint8_t>(150, 640), 255);
}

}  // namespace
}  // namespace vcharge
