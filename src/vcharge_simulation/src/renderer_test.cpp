#include "vcharge_simulation/renderer.h"

#include <cmath>
#include <cstdio>

#include <gtest/gtest.h>
#include <tbb/global_control.h>
#include <Eigen/SVD>
#include <opencv2/imgproc.hpp>

#include "vcharge_simulation/camera_response.h"
#include "vcharge_simulation/drive_simulator.h"
#include "vcharge_simulation/golf_rig.h"
#include "vcharge_simulation/lot_scene.h"

namespace vcharge {
namespace {

constexpr double kDegree = 3.14159265358979323846 / 180.0;
constexpr double kMaxIncidence_rad = 75.0 * kDegree;

// A lot with coarser maps than the default: quick to build, sharp enough for small images.
std::shared_ptr<const Renderer> testLot() {
  static const std::shared_ptr<const Renderer> renderer = [] {
    LotOptions options;
    options.ground_texel_m = 0.025;
    options.light_texel_m = 0.1;
    options.foliage_density = 0.5;
    return std::make_shared<const Renderer>(buildLotScene(options));
  }();
  return renderer;
}

std::shared_ptr<const Scene> planeScene() {
  auto scene = std::make_shared<Scene>();
  Material material;
  material.kind = SurfaceKind::kGround;
  const uint32_t ground = scene->addMaterial(material);
  addQuad({-500, -500, 0}, {500, -500, 0}, {500, 500, 0}, {-500, 500, 0}, ground, &scene->mesh);
  scene->sky = std::make_unique<Sky>(LightOptions(), 1);
  return scene;
}

TEST(RendererTest, RangeOfThePlaneFollowsTheFormula) {
  const Renderer renderer(planeScene());
  const CameraRig rig = makeGolfRig(1, 0.1);
  const RigidTransform world_from_vehicle(rotationFromYawPitchRoll(0.7, 0.01, -0.02), {3.0, -4.0, 0.02});
  for (const RigCamera& camera : rig.cameras) {
    const CameraView view(camera, nullptr);
    const cv::Mat range_m = renderer.renderRange(view, world_from_vehicle);
    const RigidTransform world_from_camera = world_from_vehicle * *camera.vehicle_from_camera;
    int seen = 0;
    for (int y = 0; y < range_m.rows; ++y) {
      for (int x = 0; x < range_m.cols; ++x) {
        Eigen::Vector3d ray;
        if (view.centreRay(x, y).isZero() || !camera.model.unproject({x, y}, &ray)) {
          EXPECT_TRUE(std::isnan(range_m.at<float>(y, x)));
          continue;
        }
        const Eigen::Vector3d direction = world_from_camera.rotation() * ray;
        const double expected_m = -world_from_camera.translation().z() / direction.z();
        if (direction.z() > 0.0) {
          EXPECT_TRUE(std::isnan(range_m.at<float>(y, x)));
        } else if (expected_m < 100.0) {
          EXPECT_NEAR(range_m.at<float>(y, x), expected_m, 1e-4 * expected_m);
          ++seen;
        }
      }
    }
    EXPECT_GT(seen, 1000);
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

// Mean absolute difference of gray between pixels of `from` and where the exact range puts them in `to`: seen
// by both, at less than 75 degrees from the surface's normal.
constexpr double kMinResolution = 0.8;
constexpr double kMaxRangeStep = 0.05;
constexpr int kSamples = 4;
struct Reprojection {
  double mean_difference = 0.0;
  int count = 0;
};
enum class Surfaces { kAll, kNoCars };
Reprojection reproject(const CameraView& from, const RigidTransform& world_from_vehicle_1,
                       const CameraView& to, const RigidTransform& world_from_vehicle_2,
                       Surfaces surfaces = Surfaces::kAll) {
  const CameraResponse response;
  const auto develop = [&](const CameraView& view, const RigidTransform& pose) {
    cv::Mat light = testLot()->renderLight(view, pose);
    cv::Mat flat;
    cv::divide(light, cv::max(view.vignette(), 0.05),
               flat);  // the same surface passes other parts of the lens
    return response.develop(flat);
  };
  const cv::Mat image_1 = develop(from, world_from_vehicle_1);
  const cv::Mat image_2 = develop(to, world_from_vehicle_2);
  const cv::Mat range_1 = testLot()->renderRange(from, world_from_vehicle_1);
  const cv::Mat range_2 = testLot()->renderRange(to, world_from_vehicle_2);
  const RigidTransform world_from_1 = world_from_vehicle_1 * *from.camera().vehicle_from_camera;
  const RigidTransform second_from_first =
      (world_from_vehicle_2 * *to.camera().vehicle_from_camera).inverse() * world_from_1;
  const auto point = [&](int x, int y) {
    return (from.centreRay(x, y) * range_1.at<float>(y, x)).cast<double>().eval();
  };
  Reprojection result;
  for (int y = 1; y + 1 < image_1.rows; ++y) {
    for (int x = 1; x + 1 < image_1.cols; ++x) {
      const Eigen::Vector3d here = point(x, y);
      const Eigen::Vector3d normal =
          (point(x + 1, y) - point(x - 1, y)).cross(point(x, y + 1) - point(x, y - 1)).normalized();
      const double incidence_rad = std::acos(std::min(1.0, std::abs(normal.dot(here.normalized()))));
      if (!(incidence_rad < kMaxIncidence_rad && from.centreRay(x, y).z() > std::cos(kMaxIncidence_rad))) {
        continue;  // also where the range is NaN
      }
      const Eigen::Vector3d there = second_from_first * here;
      const double cos_incidence_there =
          std::abs((second_from_first.rotation() * normal).dot(there.normalized()));
      Eigen::Vector2d pixel;
      if (cos_incidence_there < std::cos(kMaxIncidence_rad) ||
          there.z() < std::cos(kMaxIncidence_rad) * there.norm() ||
          !to.camera().model.project(there, &pixel)) {
        continue;
      }
      const int u = static_cast<int>(std::floor(pixel.x()));
      const int v = static_cast<int>(std::floor(pixel.y()));
      if (u < 0 || v < 0 || u + 1 >= image_2.cols || v + 1 >= image_2.rows) {
        continue;
      }
      // Neither partly hidden in `to`, nor beside an outline in `from`: such a pixel shows two things.
      bool visible = true;
      for (int k = 0; k < 4; ++k) {
        visible =
            visible && std::abs(range_2.at<float>(v + k / 2, u + k % 2) - there.norm()) < 0.03 * there.norm();
      }
      for (int k = 0; k < 9; ++k) {
        visible = visible && std::abs(range_1.at<float>(y + k / 3 - 1, x + k % 3 - 1) - here.norm()) <
                                 kMaxRangeStep * here.norm();
      }
      if (!visible) {
        continue;
      }
      // What one pixel of `from` covers in `to`. A view that is coarser in any direction cannot reproduce a
      // finer one; a finer one is averaged over the coarser one's pixel.
      Eigen::Vector2d right, left, below, above;
      const auto project = [&](int column, int row, Eigen::Vector2d* at) {
        return to.camera().model.project(second_from_first * point(column, row), at);
      };
      if (!project(x + 1, y, &right) || !project(x - 1, y, &left) || !project(x, y + 1, &below) ||
          !project(x, y - 1, &above)) {
        continue;
      }
      Eigen::Matrix2d footprint;
      footprint << 0.5 * (right - left), 0.5 * (below - above);
      if (Eigen::JacobiSVD<Eigen::Matrix2d>(footprint).singularValues().y() < kMinResolution) {
        continue;
      }
      if (surfaces == Surfaces::kNoCars) {
        const Eigen::Vector3d& eye = world_from_1.translation();
        SurfaceKind kind = SurfaceKind::kOther;
        testLot()->castRay(eye, (world_from_1 * here - eye).normalized(), 0.0, &kind);
        if (kind == SurfaceKind::kCar) {
          continue;
        }
      }
      double gray = 0.0;
      bool inside = true;
      for (int k = 0; k < kSamples * kSamples; ++k) {
        const Eigen::Vector2d sample(k % kSamples, k / kSamples);  // NOLINT: whole column and row
        const Eigen::Vector2d offset = (sample.array() + 0.5) / kSamples - 0.5;
        const Eigen::Vector2d at = pixel + footprint * offset;
        const int column = static_cast<int>(std::floor(at.x()));
        const int row = static_cast<int>(std::floor(at.y()));
        if (column < 0 || row < 0 || column + 1 >= image_2.cols || row + 1 >= image_2.rows) {
          inside = false;
          break;
        }
        const double a = at.x() - column;
        const double b = at.y() - row;
        gray += ((1 - a) * (1 - b) * image_2.at<uint8_t>(row, column) +
                 a * (1 - b) * image_2.at<uint8_t>(row, column + 1) +
                 (1 - a) * b * image_2.at<uint8_t>(row + 1, column) +
                 a * b * image_2.at<uint8_t>(row + 1, column + 1)) /
                (kSamples * kSamples);
      }
      if (!inside) {
        continue;
      }
      result.mean_difference += std::abs(gray - image_1.at<uint8_t>(y, x));
      ++result.count;
    }
  }
  result.mean_difference /= std::max(1, result.count);
  return result;
}

TEST(RendererTest, ExactRangeReproducesTheImageFromFrameToFrame) {
  const DrivePlan plan = planLotDrive("short");
  const SimulatedDrive drive = simulateDrive(plan.path, plan.motion, WheelOdometerOptions(), 1, 1);
  const CameraRig rig = makeGolfRig(1, 0.5);
  for (const size_t camera : {0U, 1U}) {
    const CameraView view(rig.cameras[camera], nullptr);
    const Reprojection result = reproject(view, drive.world_from_vehicle[10].world_from_vehicle, view,
                                          drive.world_from_vehicle[11].world_from_vehicle);
    RecordProperty("mean_difference_milligray_" + rig.cameras[camera].name,
                   static_cast<int>(1000 * result.mean_difference));
    EXPECT_GT(result.count, 20000);
    EXPECT_LE(result.mean_difference, 3.0) << rig.cameras[camera].name;
  }
}

TEST(RendererTest, ExactRangeReproducesTheImageFromCameraToCamera) {
  const CameraRig rig = makeGolfRig(1, 0.5);
  // One place is seen through different parts of the two lenses: as the vignette is divided out, the blur,
  // which is twice as wide at the rim, is left out.
  const CameraView front(rig.cameras[0], nullptr, kIdealLens);
  const CameraView left(rig.cameras[1], nullptr, kIdealLens);
  double sum = 0.0;
  int count = 0;
  for (const RigidTransform& pose :
       {RigidTransform::planar(-5.0, 0.2, 0.1), RigidTransform::planar(4.0, -0.5, -0.3)}) {
    // Paint and glass mirror other surroundings into each camera, by physics: 4 to 12 gray levels; they are
    // left out.
    for (const Reprojection& result : {reproject(front, pose, left, pose, Surfaces::kNoCars),
                                       reproject(left, pose, front, pose, Surfaces::kNoCars)}) {
      sum += result.count * result.mean_difference;
      count += result.count;
    }
  }
  std::printf("mean difference %.2f gray levels on %d pixels\n", sum / count, count);
  EXPECT_GT(count, 3000);
  EXPECT_LE(sum / count, 3.0);
}

TEST(RendererTest, LensBlursAnEdgeByItsPointSpread) {
  LensOptions lens;
  const double scale = 0.5;
  cv::Mat edge(40, 200, CV_32FC1, cv::Scalar(0.0));
  edge.colRange(100, 200).setTo(1.0);
  for (const double angle_rad : {0.0, 60.0 * kDegree, 90.0 * kDegree}) {
    const double sigma_px = lens.blurAt(angle_rad, 1.0);
    cv::Mat blurred = edge.clone();
    LensBlur(cv::Mat(edge.size(), CV_32FC1, cv::Scalar(sigma_px))).apply(&blurred);
    // The slope of the edge is the point spread: its sum is 1, its variance that of the blur.
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

// A checkerboard of 1 m squares on the ground, with a post.
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

// Also where the ground is so plain that its samples are not traced.
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
