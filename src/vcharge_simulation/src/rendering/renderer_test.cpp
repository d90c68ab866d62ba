#include "vcharge_simulation/rendering/renderer.h"

#include <cmath>

#include <gtest/gtest.h>
#include <tbb/global_control.h>
#include <opencv2/imgproc.hpp>

#include "scenes/catalogue_cases.h"
#include "scenes/scene_builders.h"
#include "vcharge_simulation/sensors/camera_response.h"
#include "vcharge_simulation/sensors/golf_rig.h"

namespace vcharge {
namespace {

constexpr double kDegree = 3.14159265358979323846 / 180.0;

// A lot with coarser maps than the default: quick to build, sharp enough for small images.
std::shared_ptr<const Renderer> testLot() {
  static const std::shared_ptr<const Renderer> renderer = [] {
    SceneOptions options;
    options.image_scale = options.detail = 0.5;
    return std::make_shared<const Renderer>(buildLotScene(options));
  }();
  return renderer;
}

TEST(RendererTest, RangeOfThePlaneFollowsTheFormula) {
  const RigidTransform world_from_vehicle(rotationFromYawPitchRoll(0.7, 0.01, -0.02), {3.0, -4.0, 0.02});
  for (const RigCamera& camera : makeGolfRig(1, 0.1).cameras) {
    expectRangesOfPlane(CameraView(camera, nullptr), world_from_vehicle);
  }
}

TEST(RendererTest, SameBytesOnAnyNumberOfThreads) {
  const CameraView view(makeGolfRig(1, 0.2).cameras[1], makeGolfBody());
  const RigidTransform pose = RigidTransform::planar(-5.0, 0.2, 0.1);
  cv::Mat one;
  {
    const tbb::global_control limit(tbb::global_control::max_allowed_parallelism, 1);
    one = testLot()->renderLight(view, pose);
  }
  const cv::Mat many = testLot()->renderLight(view, pose);
  EXPECT_EQ(cv::norm(one, many, cv::NORM_INF), 0.0);
}

TEST(RendererTest, MaskIsZeroExactlyWhereTheBodyIsSeenOrBesideIt) {
  const CameraView view(makeGolfRig(1, 0.25).cameras[1], makeGolfBody());
  const double masked = 1.0 - static_cast<double>(cv::countNonZero(view.mask())) / view.size().area();
  EXPECT_GT(masked, 0.03);
  EXPECT_LT(masked, 0.35);
  const cv::Mat range_m = Renderer(planeScene()).renderRange(view, RigidTransform());
  for (int y = 0; y < range_m.rows; ++y) {
    for (int x = 0; x < range_m.cols; ++x) {
      const Eigen::Vector3d ray =
          view.camera().vehicle_from_camera->rotation() * view.centreRay(x, y).cast<double>();
      if (view.mask().at<uint8_t>(y, x) != 0 && ray.z() < -0.05) {
        EXPECT_FALSE(std::isnan(range_m.at<float>(y, x)));
      }
    }
  }
}

constexpr LensOptions kIdealLens{0.0, 0.0, 0.0};

TEST(RendererTest, LensBlursAnEdgeByItsPointSpread) {
  LensOptions lens;
  const double scale = 0.5;
  cv::Mat edge(40, 200, CV_32FC1, cv::Scalar(0.0));
  edge.colRange(100, 200).setTo(1.0);
  for (const double angle_rad : {0.0, 60.0 * kDegree, 90.0 * kDegree}) {
    const double sigma_px = lens.blurAt(angle_rad, 1.0);
    cv::Mat blurred = edge.clone();
    LensBlur(cv::Mat(edge.size(), CV_32FC1, cv::Scalar(sigma_px))).apply(&blurred);
    // The derivative of the blurred edge is the point spread function: it sums to 1 and has the variance of
    // the blur.
    double sum = 0.0;
    double variance = 0.0;
    for (int x = 1; x < edge.cols; ++x) {
      const double weight = blurred.at<float>(20, x) - blurred.at<float>(20, x - 1);
      sum += weight;
      variance += weight * (x - 100) * (x - 100);
    }
    EXPECT_NEAR(sum, 1.0, 1e-5);
    EXPECT_NEAR(std::sqrt(variance), sigma_px, 1e-3);
    EXPECT_NEAR(lens.blurAt(angle_rad, scale), scale * sigma_px, 1e-12);
  }
  EXPECT_LT(lens.blurAt(0.0, 1.0), lens.blurAt(90.0 * kDegree, 1.0));
}

constexpr int kDarkSquare = 60;
constexpr int kBrightSquare = 200;

// A checkerboard of 1 m squares on the ground.
std::shared_ptr<Scene> checkerboardScene() {
  constexpr int kTexelsPerM = 16;
  constexpr int kWidth_m = 64;
  cv::Mat board(kWidth_m * kTexelsPerM, kWidth_m * kTexelsPerM, CV_8UC1);
  for (int y = 0; y < board.rows; ++y) {
    for (int x = 0; x < board.cols; ++x) {
      board.at<uint8_t>(y, x) = (x / kTexelsPerM + y / kTexelsPerM) % 2 == 0 ? kDarkSquare : kBrightSquare;
    }
  }
  auto scene = std::make_shared<Scene>();
  Material material;
  material.kind = SurfaceKind::kGround;
  material.mapping = Material::Mapping::kGround;
  material.texture = 0;
  const uint32_t ground = scene->addMaterial(material);
  scene->ground.layers.push_back({Texture(board, Texture::Border::kClamp), -0.5F * kWidth_m, -0.5F * kWidth_m,
                                  static_cast<float>(kTexelsPerM)});
  addQuad({-32, -32, 0}, {32, -32, 0}, {32, 32, 0}, {-32, 32, 0}, ground, &scene->mesh);
  scene->sky = std::make_unique<Sky>(LightOptions(), 1);
  return scene;
}

// Also covers ground blocks whose samples are not traced individually.
TEST(RendererTest, CheckerboardKeepsItsSquaresNearbyAndItsMeanFarAway) {
  const Renderer renderer(checkerboardScene());
  const CameraView view(makeGolfRig(1, 0.5).cameras[1], nullptr, kIdealLens);
  const RigidTransform world_from_vehicle = RigidTransform::planar(0.3, 0.2, 0.4);
  const RigidTransform world_from_camera = world_from_vehicle * *view.camera().vehicle_from_camera;
  const cv::Mat light = renderer.renderLight(view, world_from_vehicle);
  const LightOptions sky;
  const double lit = kGroundLayerAlbedo / 255.0 *
                     (sky.sun_irradiance * std::sin(sky.sun_elevation_rad) + sky.sky_irradiance);
  int near_pixels = 0;
  int far_pixels = 0;
  double far_albedo = 0.0;
  for (int y = 0; y < light.rows; ++y) {
    for (int x = 0; x < light.cols; ++x) {
      const Eigen::Vector3d ray = world_from_camera.rotation() * view.centreRay(x, y).cast<double>();
      if (ray.z() >= -1e-3) {
        continue;
      }
      const double range_m = -world_from_camera.translation().z() / ray.z();
      const Eigen::Vector3d point = world_from_camera.translation() + range_m * ray;
      const double albedo = light.at<float>(y, x) / view.vignette().at<float>(y, x) / lit;
      const double edge_x_m = std::abs(point.x() - std::round(point.x()));
      const double edge_y_m = std::abs(point.y() - std::round(point.y()));
      if (range_m < 4.0 && std::min(edge_x_m, edge_y_m) > 0.15) {
        const bool dark =
            (static_cast<int>(std::floor(point.x())) + static_cast<int>(std::floor(point.y()))) % 2 == 0;
        ASSERT_NEAR(albedo, dark ? kDarkSquare : kBrightSquare, 3.0) << "pixel " << x << ", " << y;
        ++near_pixels;
      } else if (range_m > 15.0 && range_m < 25.0 && point.cwiseAbs().maxCoeff() < 30.0) {
        far_albedo += albedo;
        ++far_pixels;
      }
    }
  }
  EXPECT_GT(near_pixels, 10000);
  EXPECT_GT(far_pixels, 500);
  EXPECT_NEAR(far_albedo / far_pixels, 0.5 * (kDarkSquare + kBrightSquare), 8.0);
}

// Steeper rays than the flattest that the shader shifts by its true amount.
TEST(RendererTest, ReliefThatIsRaisedEverywhereLooksLikeLevelGroundFromALowerCamera) {
  constexpr float kRaised_m = 0.05F;
  const auto raised = checkerboardScene();
  raised->ground.details.push_back(
      {Texture(cv::Mat(64, 64, CV_8UC1, cv::Scalar(255)), Texture::Border::kRepeat), 0.0F, 0.0F, 1.0F});
  raised->ground.detail_contrast = 0.0F;
  raised->ground.relief_m = 2.0F * kRaised_m;
  const CameraView view(makeGolfRig(1, 0.5).cameras[1], nullptr, kIdealLens);
  const RigidTransform pose = RigidTransform::planar(0.3, 0.2, 0.4);
  const RigidTransform lower = RigidTransform(Eigen::Quaterniond::Identity(), {0.0, 0.0, -kRaised_m}) * pose;
  const cv::Mat relief = Renderer(raised).renderLight(view, pose);
  const cv::Mat flat = Renderer(checkerboardScene()).renderLight(view, pose);
  const cv::Mat expected = Renderer(checkerboardScene()).renderLight(view, lower);
  const Eigen::Quaterniond vehicle_from_camera = view.camera().vehicle_from_camera->rotation();
  double difference = 0.0;
  double without_relief = 0.0;
  for (int y = 0; y < flat.rows; ++y) {
    for (int x = 0; x < flat.cols; ++x) {
      if ((vehicle_from_camera * view.centreRay(x, y).cast<double>()).z() < -0.2) {
        difference += std::abs(relief.at<float>(y, x) - expected.at<float>(y, x));
        without_relief += std::abs(flat.at<float>(y, x) - expected.at<float>(y, x));
      }
    }
  }
  EXPECT_GT(without_relief, 10.0);
  EXPECT_LT(difference, 0.05 * without_relief);
}

// The edge of the light on a wall appears at the same subpixel row as in the range image.
TEST(RendererTest, LightLiesWhereItsSurfaceIs) {
  constexpr int kTexels = 256;
  constexpr float kHalf_m = 2.0F;
  cv::Mat light_map(kTexels, kTexels, CV_8UC1, cv::Scalar(0));
  light_map.rowRange(0, kTexels / 2).setTo(255);
  auto scene = std::make_shared<Scene>();
  Material material;
  material.translucency = 1.0F;  // lit from any direction of the sun
  material.sun_map = 0;
  material.sun_map_texels_per_m = kTexels / (2.0F * kHalf_m);
  scene->textures.emplace_back(light_map, Texture::Border::kClamp);
  const uint32_t wall = scene->addMaterial(material);
  constexpr float kWall_m = 6.0F;
  constexpr float kEdge_m = 1.0F;
  addQuad({kWall_m, kHalf_m, kEdge_m - kHalf_m}, {kWall_m, -kHalf_m, kEdge_m - kHalf_m},
          {kWall_m, -kHalf_m, kEdge_m + kHalf_m}, {kWall_m, kHalf_m, kEdge_m + kHalf_m}, wall, &scene->mesh);
  scene->sky = std::make_unique<Sky>(LightOptions(), 1);
  const Renderer renderer(scene);
  const RigCamera camera = makeGolfRig(1, 0.5).cameras[0];
  const CameraView view(camera, nullptr, kIdealLens);
  cv::Mat light;
  cv::divide(renderer.renderLight(view, RigidTransform()), view.vignette(), light);
  const cv::Mat range_m = renderer.renderRange(view, RigidTransform());
  const auto height = [&](int x, int y) {
    return (*camera.vehicle_from_camera * (range_m.at<float>(y, x) * view.centreRay(x, y).cast<double>()))
        .z();
  };
  int columns = 0;
  double mean_error_px = 0.0;
  for (int x = 0; x < light.cols; ++x) {
    // Rows around the edge that all lie on the wall.
    constexpr int kReach = 8;
    int first_below = 0;
    while (first_below < light.rows && !(height(x, first_below) < kEdge_m)) {
      ++first_below;
    }
    const int top = first_below - kReach;
    if (first_below + kReach >= light.rows || top < 0 || std::isnan(height(x, top)) ||
        std::isnan(height(x, first_below + kReach))) {
      continue;
    }
    const double above_m = height(x, first_below - 1);
    const double edge = first_below - 1 + (above_m - kEdge_m) / (above_m - height(x, first_below));
    const double bright = light.at<float>(top, x);
    const double dark = light.at<float>(first_below + kReach, x);
    double seen = top - 0.5;
    for (int y = top; y < first_below + kReach; ++y) {
      seen += (light.at<float>(y, x) - dark) / (bright - dark);
    }
    mean_error_px += seen - edge;
    ++columns;
  }
  ASSERT_GT(columns, 50);
  EXPECT_NEAR(mean_error_px / columns, 0.0, 0.05);
}

TEST(RendererTest, PostsAndKerbsOnPlainGroundAreNotOverlooked) {
  const auto with_post = checkerboardScene();
  Material black;
  black.albedo = 0.0F;
  const uint32_t post = with_post->addMaterial(black);
  for (const double x : {-2.0, 0.0, 2.0}) {
    const double y = 4.0;
    addFrustum(Eigen::Vector3d(x, y, 0.0).cast<float>(), Eigen::Vector3d(x, y, 0.3).cast<float>(), 0.03F,
               0.03F, 8, true, post, &with_post->mesh);
  }
  const Renderer renderer(with_post);
  const CameraView view(makeGolfRig(1, 1.0).cameras[1], nullptr, kIdealLens);
  const RigidTransform pose;
  const cv::Mat light = renderer.renderLight(view, pose);
  const RigidTransform world_from_camera = *view.camera().vehicle_from_camera;
  int on_post = 0;
  int black_pixels = 0;
  for (int y = 0; y < light.rows; ++y) {
    for (int x = 0; x < light.cols; ++x) {
      const Eigen::Vector3d ray = world_from_camera.rotation() * view.centreRay(x, y).cast<double>();
      SurfaceKind kind = SurfaceKind::kGround;
      if (!view.centreRay(x, y).isZero() &&
          renderer.castRay(world_from_camera.translation(), ray, 0.0, &kind) && kind == SurfaceKind::kOther) {
        ++on_post;
        black_pixels += light.at<float>(y, x) < 0.5F * kDarkSquare / 255.0F ? 1 : 0;
      }
    }
  }
  EXPECT_GT(on_post, 100);
  EXPECT_GT(black_pixels, 0.9 * on_post);
}

}  // namespace
}  // namespace vcharge
