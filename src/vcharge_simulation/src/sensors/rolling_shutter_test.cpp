#include <cmath>
#include <utility>

#include <gtest/gtest.h>

#include "vcharge_core/base/error.h"
#include "vcharge_simulation/rendering/renderer.h"

namespace vcharge {
namespace {

constexpr LensOptions kIdealLens{0.0, 0.0, 0.0};
constexpr double kFocal_px = 200.0;
const cv::Size kSize(240, 160);
constexpr double kReadout_s = 0.03;
constexpr float kWall_m = 6.0F;

// A pinhole camera 1 m above the vehicle's origin that looks ahead.
CameraView pinholeView() {
  Eigen::VectorXd parameters(8);
  parameters << kFocal_px, kFocal_px, 0.5 * (kSize.width - 1), 0.5 * (kSize.height - 1), 0.0, 0.0, 0.0, 0.0;
  RigCamera camera{"front", "camera_front_optical", kSize, CameraModel::create("pinhole", parameters)};
  camera.vehicle_from_camera =
      RigidTransform(Eigen::Quaterniond(0.5, -0.5, 0.5, -0.5), Eigen::Vector3d(0.0, 0.0, 1.0));
  return CameraView(camera, nullptr, kIdealLens);
}

// A wall at x = kWall_m, luminous at y > 0 and black at y < 0.
std::shared_ptr<Scene> wallScene() {
  auto scene = std::make_shared<Scene>();
  Material material;
  material.albedo = 0.0F;
  material.two_sided = true;
  const uint32_t black = scene->addMaterial(material);
  material.emission = 1.0F;
  const uint32_t luminous = scene->addMaterial(material);
  addQuad({kWall_m, 0, -50}, {kWall_m, 50, -50}, {kWall_m, 50, 50}, {kWall_m, 0, 50}, luminous, &scene->mesh);
  addQuad({kWall_m, -50, -50}, {kWall_m, 0, -50}, {kWall_m, 0, 50}, {kWall_m, -50, 50}, black, &scene->mesh);
  scene->sky = std::make_unique<Sky>(LightOptions(), 1);
  return scene;
}

// Turns about the camera's position.
MotionWindow turning(double rate_rad_per_s) {
  std::vector<RigidTransform> poses;
  for (int ms = -20; ms <= 20; ++ms) {
    poses.push_back(RigidTransform::planar(0.0, 0.0, 1e-3 * ms * rate_rad_per_s));
  }
  return MotionWindow(std::move(poses));
}

double timeOfRow(int row) {
  return kReadout_s * ((row + 0.5) / kSize.height - 0.5);
}

// Column of the edge in each row, from the number of luminous pixels left of it.
std::vector<double> edgeColumns(const cv::Mat& light, const CameraView& view) {
  std::vector<double> columns;
  for (int y = 0; y < light.rows; ++y) {
    double luminous = 0.0;
    for (int x = 0; x < light.cols; ++x) {
      luminous += light.at<float>(y, x) / view.vignette().at<float>(y, x);
    }
    columns.push_back(luminous - 0.5);
  }
  return columns;
}

TEST(RollingShutterTest, TurningCameraShearsAVerticalEdge) {
  const Renderer renderer(wallScene());
  const CameraView view = pinholeView();
  for (const double rate_rad_per_s : {2.0, -1.0}) {
    const std::vector<double> columns =
        edgeColumns(renderer.renderLight(view, Readout(turning(rate_rad_per_s), kReadout_s)), view);
    double shear = 0.0;
    double sum_of_squares = 0.0;
    for (int y = 0; y < kSize.height; ++y) {
      const double angle_rad = rate_rad_per_s * timeOfRow(y);
      const double expected = 0.5 * (kSize.width - 1) + kFocal_px * std::tan(angle_rad);
      // Four samples per pixel; the two rows of a block share one instant.
      EXPECT_NEAR(columns[static_cast<size_t>(y)], expected, 0.2) << y;
      const double row = y - 0.5 * (kSize.height - 1);
      shear += row * columns[static_cast<size_t>(y)];
      sum_of_squares += row * row;
    }
    const double expected_shear = kFocal_px * rate_rad_per_s * kReadout_s / kSize.height;
    EXPECT_NEAR(shear / sum_of_squares, expected_shear, 0.01 * std::abs(expected_shear));
  }
}

TEST(RollingShutterTest, RangeOfEachRowIsThatAtItsTime) {
  const Renderer renderer(wallScene());
  const CameraView view = pinholeView();
  const cv::Mat range_m = renderer.renderRange(view, Readout(turning(2.0), kReadout_s));
  for (int y = 0; y < kSize.height; y += 9) {
    for (int x = 0; x < kSize.width; x += 9) {
      const Eigen::Vector3d ray = RigidTransform::planar(0.0, 0.0, 2.0 * timeOfRow(y)).rotation() *
                                  view.camera().vehicle_from_camera->rotation() *
                                  view.centreRay(x, y).cast<double>();
      EXPECT_NEAR(range_m.at<float>(y, x), kWall_m / ray.x(), 3e-4 * kWall_m);
    }
  }
}

TEST(RollingShutterTest, WithoutReadoutTimeEveryRowIsSeenAtTheStamp) {
  const Renderer renderer(wallScene());
  const CameraView view = pinholeView();
  const Readout at_once(turning(2.0), 0.0);
  const cv::Mat light = renderer.renderLight(view, at_once);
  EXPECT_EQ(cv::norm(light, renderer.renderLight(view, RigidTransform()), cv::NORM_INF), 0.0);
  EXPECT_EQ(cv::norm(renderer.renderRange(view, at_once), renderer.renderRange(view, RigidTransform()),
                     cv::NORM_INF),
            0.0);
  EXPECT_GT(cv::norm(light, renderer.renderLight(view, Readout(turning(2.0), kReadout_s)), cv::NORM_INF),
            0.0);
}

TEST(RollingShutterTest, MoversMoveDuringTheReadout) {
  constexpr double kApproach_m_per_s = 10.0;
  const auto scene = wallScene();
  Mover shield;
  shield.name = "shield";
  shield.stateAt = [](double) { return MoverState(); };
  shield.meshAt = [](double time_s) {
    TriangleMesh mesh;
    const auto x = static_cast<float>(4.0 - kApproach_m_per_s * time_s);
    addQuad({x, -50, -50}, {x, 50, -50}, {x, 50, 50}, {x, -50, 50}, 0, &mesh);
    return mesh;
  };
  scene->movers.push_back(shield);
  const Renderer renderer(scene);
  const CameraView view = pinholeView();
  constexpr double kTime_s = 0.1;
  const cv::Mat range_m =
      renderer.renderRange(view, Readout(MotionWindow(RigidTransform()), kReadout_s), kTime_s);
  for (int y = 0; y < kSize.height; ++y) {
    const double distance_m = 4.0 - kApproach_m_per_s * (kTime_s + timeOfRow(y));
    const double expected_m = distance_m / view.centreRay(120, y).z();
    // Movers move in steps of 2 ms.
    EXPECT_NEAR(range_m.at<float>(y, 120), expected_m, 1.15e-3 * kApproach_m_per_s) << y;
  }
}

TEST(MotionWindowTest, InterpolatesBetweenMillisecondsAndEndsAtItsLastPose) {
  const MotionWindow window({RigidTransform::planar(1.0, 0.0, 0.0), RigidTransform::planar(2.0, 0.0, 0.0),
                             RigidTransform::planar(4.0, 0.0, 0.0)});
  EXPECT_EQ(window.at(0.0).translation().x(), 2.0);
  EXPECT_NEAR(window.at(-0.00025).translation().x(), 1.75, 1e-12);
  EXPECT_NEAR(window.at(0.0005).translation().x(), 3.0, 1e-12);
  EXPECT_EQ(window.at(0.001).translation().x(), 4.0);
  EXPECT_THROW(window.at(0.0011), std::logic_error);
  EXPECT_THROW(window.at(-0.0011), std::logic_error);
  EXPECT_THROW(MotionWindow(std::vector<RigidTransform>(2)), std::logic_error);
  EXPECT_EQ(MotionWindow(RigidTransform::planar(5.0, 0.0, 0.0)).at(7.0).translation().x(), 5.0);
}

}  // namespace
}  // namespace vcharge
