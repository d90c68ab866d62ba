#include "vcharge_simulation/sensors/recorded_cameras.h"

#include <gtest/gtest.h>
#include <opencv2/core.hpp>

#include "vcharge_core/base/error.h"

namespace vcharge {
namespace {

constexpr double kDegree = 3.14159265358979323846 / 180.0;
constexpr std::chrono::milliseconds kBefore(399);
constexpr std::chrono::milliseconds kAfter(400);

RecordedCameras make(const std::string& options) {
  DriveScenario scenario;
  scenario.image_scale = 0.1;
  readFields(YAML::Load(options), "scenario.yaml", &scenario);
  return RecordedCameras(scenario, "masks");
}

TEST(RecordedCamerasTest, SelectionKeepsTheOrderAndTheIndexInTheRig) {
  const RecordedCameras cameras = make("cameras: [right, left]");
  ASSERT_EQ(cameras.size(), 2U);
  EXPECT_EQ(cameras.name(0), "right");
  EXPECT_EQ(cameras.index(0), 3);
  EXPECT_EQ(cameras.index(1), 1);
  EXPECT_FALSE(cameras.isRigFaulty());
}

TEST(RecordedCamerasTest, BumpTurnsTheCameraByItsAngleFromItsTimeOn) {
  const RecordedCameras cameras = make(
      "faults: {bumped_camera: {cameras: [left], start_s: 0.4, rotation_rad: [0, 0.03, 0.04], "
      "translation_m: [0.01, 0, 0]}}");
  const size_t left = cameras.rig().cameraIndex("left");
  const auto mounting = [&](size_t camera, Duration time) {
    return *cameras.view(camera, time).camera().vehicle_from_camera;
  };
  const RigidTransform truth = *cameras.rig().cameras[left].vehicle_from_camera;
  EXPECT_EQ(mounting(left, kBefore).matrix(), truth.matrix());
  const RigidTransform before_from_after = truth.inverse() * mounting(left, kAfter);
  EXPECT_NEAR(angleOfRotation(before_from_after.rotation()), 0.05, 1e-9);
  EXPECT_NEAR(before_from_after.translation().x(), 0.01, 1e-9);
  const CameraRig after = cameras.rigAfterFaults();
  EXPECT_TRUE(cameras.isRigFaulty());
  for (size_t i = 0; i < cameras.size(); ++i) {
    EXPECT_EQ(after.cameras[i].vehicle_from_camera->matrix(), mounting(i, kAfter).matrix());
    EXPECT_EQ(mounting(i, kBefore).matrix() == mounting(i, kAfter).matrix(), i != left);
    EXPECT_EQ(cv::norm(after.cameras[i].mask, cameras.rig().cameras[i].mask, cv::NORM_INF) > 0.0, i == left);
  }
  // Every ray of a pixel is rotated by the same angle.
  Eigen::Vector3d ray;
  ASSERT_TRUE(after.cameras[left].model.unproject(Eigen::Vector2d(64.0, 40.0), &ray));
  const Eigen::Vector3d seen_before = truth.rotation() * ray;
  const Eigen::Vector3d seen_after = after.cameras[left].vehicle_from_camera->rotation() * ray;
  EXPECT_GT(std::acos(seen_before.dot(seen_after)), 1.5 * kDegree);
}

TEST(RecordedCamerasTest, SwappedCamerasDeliverUnderEachOthersName) {
  const RecordedCameras cameras = make("faults: {swapped_cameras: {cameras: [left, right], start_s: 0.4}}");
  const size_t left = cameras.rig().cameraIndex("left");
  const size_t right = cameras.rig().cameraIndex("right");
  const size_t front = cameras.rig().cameraIndex("front");
  EXPECT_EQ(cameras.plug(left, kBefore), left);
  EXPECT_EQ(cameras.plug(left, kAfter), right);
  EXPECT_EQ(cameras.plug(right, kAfter), left);
  EXPECT_EQ(cameras.plug(front, kAfter), front);
  const CameraRig after = cameras.rigAfterFaults();
  EXPECT_EQ(after.cameras[left].name, "left");
  EXPECT_EQ(after.cameras[left].frame_id, "camera_left_optical");
  EXPECT_EQ(after.cameras[left].vehicle_from_camera->matrix(),
            cameras.rig().cameras[right].vehicle_from_camera->matrix());
  EXPECT_EQ(after.cameras[right].model.parameters(), cameras.rig().cameras[left].model.parameters());
  EXPECT_EQ(after.cameras[front].vehicle_from_camera->matrix(),
            cameras.rig().cameras[front].vehicle_from_camera->matrix());
}

TEST(RecordedCamerasTest, FaultsOfCamerasThatAreNotRecordedAreRejected) {
  for (const char* options :
       {"{cameras: [left], faults: {dead_camera: {cameras: [right]}}}",
        "faults: {motion_blur: {cameras: [mirror]}}", "faults: {swapped_cameras: {cameras: [left, all]}}"}) {
    try {
      make(options);
      ADD_FAILURE() << options;
    } catch (const InputError& error) {
      EXPECT_NE(std::string(error.what()).find(".cameras"), std::string::npos) << error.what();
    }
  }
  EXPECT_NO_THROW(make("{cameras: [left], faults: {dead_camera: {cameras: [all]}}}"));
}

}  // namespace
}  // namespace vcharge
