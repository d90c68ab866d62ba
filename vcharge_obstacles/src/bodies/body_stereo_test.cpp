#include "bodies/body_stereo.h"

#include <optional>

#include <gtest/gtest.h>

#include "objects/moving_world.h"

namespace vcharge {
namespace {

/// The front camera, and one like a camera of the left side, which looks half to the front.
class BodyStereoTest : public testing::Test {
 protected:
  struct Eye {
    explicit Eye(const RigCamera& camera) : rig_camera(camera), panorama(camera) {}
    void see(const MovingWorld& world) {
      image = panorama.render(world.render(rig_camera, RigidTransform(), 0.0));
    }
    PanoramaView view() const { return {panorama, image, rig_camera.vehicle_from_camera->translation()}; }
    const RigCamera rig_camera;
    const Panorama panorama;
    cv::Mat image;
  };
  static RigCamera sideCamera() {
    RigCamera camera = makeFrontRig(0.9).cameras[0];
    const RigidTransform front = *camera.vehicle_from_camera;
    const Eigen::Quaterniond turned = rotationFromVector({0.0, 0.0, 0.9}) * front.rotation();
    camera.vehicle_from_camera =
        RigidTransform(turned, front.translation() + Eigen::Vector3d(-1.7, 1.0, 0.0));
    return camera;
  }
  /// The bearing of a position from the front camera, with an error of the range.
  BodyBearing expect(const Eigen::Vector2d& position_m, double factor) const {
    BodyBearing bearing =
        bearingFrom(front_.rig_camera.vehicle_from_camera->translation().head<2>(), position_m);
    bearing.range_m *= factor;
    return bearing;
  }
  void see(const MovingWorld& world) {
    front_.see(world);
    side_.see(world);
  }
  Eye front_{makeFrontRig(0.6).cameras[0]}, side_{sideCamera()};
};

TEST_F(BodyStereoTest, FindsTheRangeWhereverItIsExpected) {
  for (const Eigen::Vector2d& position_m :
       {Eigen::Vector2d(7.5, 2.5), Eigen::Vector2d(8.0, 1.5), Eigen::Vector2d(9.0, 3.0)}) {
    MovingWorld world;
    world.cylinders = {{position_m, {0.0, 0.0}}};
    see(world);
    for (const double factor : {0.87, 1.0, 1.15}) {
      const BodyBearing expected = expect(position_m, factor);
      const std::optional<StereoRange> found = matchBodyRange(front_.view(), side_.view(), expected, 1.7);
      ASSERT_TRUE(found) << position_m.transpose() << " expected at " << factor;
      EXPECT_NEAR(found->range_m, expected.range_m / factor, 0.25) << position_m.transpose();
      EXPECT_NEAR(found->range_m, expected.range_m / factor, 2.0 * found->sigma_m);
    }
  }
}

TEST_F(BodyStereoTest, NothingWhereOneCameraDoesNotTell) {
  MovingWorld world;
  world.cylinders = {{{5.5, 2.5}, {0.0, 0.0}}};
  see(world);
  // The side camera does not see what is far to the right.
  EXPECT_FALSE(matchBodyRange(front_.view(), side_.view(), expect({4.0, -4.0}, 1.0), 1.7));
  // What lies in the line of both cameras has no parallax.
  const Eigen::Vector2d front_m = front_.rig_camera.vehicle_from_camera->translation().head<2>();
  const Eigen::Vector2d side_m = side_.rig_camera.vehicle_from_camera->translation().head<2>();
  EXPECT_FALSE(matchBodyRange(front_.view(), side_.view(),
                              expect(front_m + 3.0 * (front_m - side_m).normalized(), 1.0), 1.7));
  side_.image.setTo(cv::Scalar(90));
  EXPECT_FALSE(matchBodyRange(front_.view(), side_.view(), expect({5.5, 2.5}, 1.0), 1.7));
}

TEST_F(BodyStereoTest, NothingWhereManyRangesFitAlike) {
  MovingWorld world;
  see(world);
  for (cv::Mat* image : {&front_.image, &side_.image}) {
    for (int column = 0; column < image->cols; ++column) {
      image->col(column).setTo(cv::Scalar(column % 8 < 4 ? 60 : 140));
    }
  }
  EXPECT_FALSE(matchBodyRange(front_.view(), side_.view(), expect({5.5, 2.5}, 1.0), 1.7));
}

}  // namespace
}  // namespace vcharge
