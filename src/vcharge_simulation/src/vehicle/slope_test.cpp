#include <cmath>
#include <memory>

#include <gtest/gtest.h>

#include "vcharge_simulation/rendering/renderer.h"
#include "vcharge_simulation/sensors/golf_rig.h"

namespace vcharge {
namespace {

constexpr LensOptions kIdealLens{0.0, 0.0, 0.0};

TEST(SlopeTest, GroundIsAsBrightAsTheCosineOfTheSunsAngleToIt) {
  const CameraView view(makeGolfRig(1, 0.1).cameras[1], nullptr, kIdealLens);
  LightOptions light;
  light.sky_irradiance = 0.0;
  light.bounce_irradiance = 0.0;
  // Compared at one point below the camera, which lies on both planes.
  const auto lightOn = [&](const Eigen::Vector3d& normal) {
    auto scene = std::make_shared<Scene>();
    scene->sky = std::make_unique<Sky>(light, 1);
    Material ground;
    ground.kind = SurfaceKind::kGround;
    ground.mapping = Material::Mapping::kGround;
    ground.texture = 0;
    scene->ground.layers.push_back(
        {Texture(cv::Mat(4, 4, CV_8UC1, cv::Scalar(100)), Texture::Border::kClamp), -100.0F, -100.0F, 0.02F});
    const Eigen::Vector3d point_m(1.9, 2.5, 0.0);
    const auto on_plane = [&](double x, double y) {
      const double z = -(normal.x() * (x - point_m.x()) + normal.y() * (y - point_m.y())) / normal.z();
      return Eigen::Vector3d(x, y, z).cast<float>().eval();
    };
    addQuad(on_plane(-50, -50), on_plane(50, -50), on_plane(50, 50), on_plane(-50, 50),
            scene->addMaterial(ground), &scene->mesh);
    const Renderer renderer(scene);
    Eigen::Vector2d pixel;
    EXPECT_TRUE(view.camera().model.project(view.camera().vehicle_from_camera->inverse() * point_m, &pixel));
    return static_cast<double>(
        renderer.renderLight(view, RigidTransform())
            .at<float>(static_cast<int>(std::lround(pixel.y())), static_cast<int>(std::lround(pixel.x()))));
  };
  const Eigen::Vector3d to_sun = Sky(light, 1).directionToSun().cast<double>();
  const double level = lightOn(Eigen::Vector3d::UnitZ());
  EXPECT_GT(level, 0.0);
  for (const Eigen::Vector3d& tilted :
       {Eigen::Vector3d(0.105, 0.0, 1.0), Eigen::Vector3d(-0.05, 0.08, 1.0)}) {
    EXPECT_NEAR(lightOn(tilted.normalized()) / level, tilted.normalized().dot(to_sun) / to_sun.z(), 1e-3);
  }
}

}  // namespace
}  // namespace vcharge
