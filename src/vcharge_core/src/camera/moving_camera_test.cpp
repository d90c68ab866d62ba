#include "vcharge_core/camera/moving_camera.h"

#include <gtest/gtest.h>

namespace vcharge {
namespace {

RigCamera makeCamera() {
  KannalaBrandtCamera::Parameters parameters;
  parameters << 200.0, 200.0, 319.5, 199.5, 0.0, 0.0, 0.0, 0.0;
  RigCamera camera{"left", "camera_left_optical", cv::Size(640, 400), KannalaBrandtCamera(parameters)};
  Eigen::Matrix3d leftward_from_optical;  // looks along the vehicle's y
  leftward_from_optical << 1.0, 0.0, 0.0, 0.0, 0.0, 1.0, 0.0, -1.0, 0.0;
  camera.vehicle_from_camera =
      RigidTransform(Eigen::Quaterniond(leftward_from_optical), Eigen::Vector3d(2.0, 0.9, 1.0));
  return camera;
}

TEST(MovingCameraTest, StandsWhileAllLinesAreExposedAtOnce) {
  const RigCamera camera = makeCamera();
  const RigidTransform map_from_vehicle = RigidTransform::planar(1.0, 2.0, 0.3);
  const MovingCamera moving(camera, map_from_vehicle, {{4.0, 0.5}});
  const RigidTransform map_from_camera = map_from_vehicle * *camera.vehicle_from_camera;
  const Eigen::Vector3d point_m(3.0, 6.0, 0.5);
  EXPECT_EQ(moving.poseAt({100.0, 30.0}).translation(), map_from_camera.translation());
  EXPECT_EQ(moving.pointInCamera(point_m), map_from_camera.inverse() * point_m);
}

TEST(MovingCameraTest, MovesWithTheVehicleFromLineToLine) {
  RigCamera camera = makeCamera();
  camera.timing = {0.04, ReadoutDirection::kDown, 0.01};
  const MovingCamera moving(camera, RigidTransform(), {{5.0, 0.0}});
  // The last line is exposed 0.01 s + half of the readout after the stamp.
  const Eigen::Vector3d moved_m =
      moving.poseAt({100.0, 399.5}).translation() - moving.mapFromCamera().translation();
  EXPECT_LT((moved_m - Eigen::Vector3d(5.0 * 0.03, 0.0, 0.0)).norm(), 1e-12);
}

TEST(MovingCameraTest, SeesAPointWhereItsLineWasExposed) {
  RigCamera camera = makeCamera();
  camera.timing = {0.03, ReadoutDirection::kDown, 0.0};
  const MovingCamera moving(camera, RigidTransform::planar(1.0, 2.0, 0.3), {{4.0, 0.6}});
  const Eigen::Vector3d point_m(3.0, 5.0, -0.5);
  Eigen::Vector2d pixel;
  ASSERT_TRUE(camera.model.project(moving.pointInCamera(point_m), &pixel));
  Eigen::Vector2d again;
  ASSERT_TRUE(camera.model.project(moving.poseAt(pixel).inverse() * point_m, &again));
  EXPECT_LT((again - pixel).norm(), 0.005);
  Eigen::Vector2d at_stamp;
  ASSERT_TRUE(camera.model.project(moving.mapFromCamera().inverse() * point_m, &at_stamp));
  EXPECT_GT((at_stamp - pixel).norm(), 1.0) << "the point should be seen in another line than the middle one";
}

}  // namespace
}  // namespace vcharge
