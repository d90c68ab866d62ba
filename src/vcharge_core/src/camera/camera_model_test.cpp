// Property tests that every camera model passes.
#include "vcharge_core/camera/camera_model.h"

#include <cmath>
#include <random>

#include <gtest/gtest.h>

namespace vcharge {
namespace {

constexpr double kPi = 3.14159265358979323846;

/// A camera and the largest angle from the axis at which it is tested.
struct TestCamera {
  std::string label;
  CameraModel camera;
  double max_angle_rad;
};

MeiCamera golfCamera() {
  return MeiCamera((MeiCamera::Parameters() << 1.1584422115726898, 895.54818314068166, 894.74426130897348,
                    649.62356964542516, 398.71903485692013, -0.33084335078197569, 0.086519827528324378,
                    -0.00067678740380559344, -3.6412961593787842e-05)
                       .finished());
}

std::vector<TestCamera> testCameras() {
  const double degree = kPi / 180.0;
  std::vector<TestCamera> cameras;
  cameras.push_back({"mei_golf", golfCamera(), 100.0 * degree});
  cameras.push_back(
      {"mei_xi_below_one",
       MeiCamera((MeiCamera::Parameters() << 0.9, 700, 702, 640, 400, -0.25, 0.05, 1e-3, -2e-3).finished()),
       100.0 * degree});
  cameras.push_back({"mei_without_distortion", MeiCamera(1.6, 1100, 1090, 500, 300), 110.0 * degree});
  cameras.push_back(
      {"kannala_brandt",
       KannalaBrandtCamera(
           (KannalaBrandtCamera::Parameters() << 330, 331, 640, 400, 0.03, -0.01, 2e-3, -4e-4).finished()),
       100.0 * degree});
  cameras.push_back(
      {"pinhole",
       PinholeCamera((PinholeCamera::Parameters() << 600, 610, 320, 240, -0.2, 0.03, 1e-3, 5e-4).finished()),
       40.0 * degree});
  return cameras;
}

Eigen::Vector3d direction(double angle_rad, double azimuth_rad) {
  return Eigen::Vector3d(std::sin(angle_rad) * std::cos(azimuth_rad),
                         std::sin(angle_rad) * std::sin(azimuth_rad), std::cos(angle_rad));
}

double angleBetween(const Eigen::Vector3d& a, const Eigen::Vector3d& b) {
  return std::atan2(a.cross(b).norm(), a.dot(b));
}

class CameraModelTest : public ::testing::TestWithParam<TestCamera> {};

TEST_P(CameraModelTest, RaysSurviveProjectionAndBack) {
  const auto& [label, camera, max_angle_rad] = GetParam();
  for (int i = 0; i <= 100; ++i) {
    for (int j = 0; j < 36; ++j) {
      const Eigen::Vector3d ray = direction(max_angle_rad * i / 100.0, 2.0 * kPi * (j + 0.3) / 36.0);
      Eigen::Vector2d pixel;
      Eigen::Vector3d back;
      ASSERT_TRUE(camera.project(7.5 * ray, &pixel))
          << label << " at " << max_angle_rad * i / 100.0 << " rad";
      ASSERT_TRUE(camera.unproject(pixel, &back)) << label << " at " << max_angle_rad * i / 100.0 << " rad";
      EXPECT_LE(angleBetween(ray, back), 1e-9);
      EXPECT_NEAR(back.norm(), 1.0, 1e-12);
    }
  }
}

TEST_P(CameraModelTest, PixelsSurviveUnprojectionAndBack) {
  const auto& [label, camera, max_angle_rad] = GetParam();
  int tested = 0;
  for (int v = 0; v < 800; v += 13) {
    for (int u = 0; u < 1280; u += 17) {
      const Eigen::Vector2d pixel(u + 0.25, v + 0.75);
      Eigen::Vector3d ray;
      if (!camera.unproject(pixel, &ray) || std::acos(std::min(1.0, ray.z())) > max_angle_rad) {
        continue;
      }
      Eigen::Vector2d back;
      ASSERT_TRUE(camera.project(ray, &back));
      EXPECT_LE((back - pixel).norm(), 1e-6) << label << " at " << pixel.transpose();
      ++tested;
    }
  }
  EXPECT_GT(tested, 1000);
}

TEST_P(CameraModelTest, JacobiansEqualNumericOnes) {
  const auto& camera = GetParam().camera;
  std::mt19937 generator(7);
  std::uniform_real_distribution<double> uniform(0.0, 1.0);
  camera.visit([&](const auto& model) {
    using Model = std::decay_t<decltype(model)>;
    for (int trial = 0; trial < 300; ++trial) {
      const double angle = trial == 0 ? 0.0 : GetParam().max_angle_rad * uniform(generator);
      const Eigen::Vector3d point =
          (0.5 + 20.0 * uniform(generator)) * direction(angle, 2.0 * kPi * uniform(generator));
      Eigen::Vector2d pixel;
      Eigen::Matrix<double, 2, 3> by_point;
      Eigen::Matrix<double, 2, Model::kNumParameters> by_parameters;
      ASSERT_TRUE(model.project(point, &pixel, &by_point, &by_parameters));

      for (int i = 0; i < 3; ++i) {
        const double step = 1e-5 * point.norm();
        Eigen::Vector3d plus = point, minus = point;
        plus[i] += step;
        minus[i] -= step;
        Eigen::Vector2d pixel_plus, pixel_minus;
        ASSERT_TRUE(model.project(plus, &pixel_plus) && model.project(minus, &pixel_minus));
        const Eigen::Vector2d numeric = (pixel_plus - pixel_minus) / (2.0 * step);
        EXPECT_LE((by_point.col(i) - numeric).norm(), 1e-5 * (1.0 + by_point.norm())) << "point " << i;
      }
      for (int i = 0; i < Model::kNumParameters; ++i) {
        const double step = 1e-6 * std::max(1.0, std::abs(model.parameters()[i]));
        typename Model::Parameters plus = model.parameters(), minus = model.parameters();
        plus[i] += step;
        minus[i] -= step;
        Eigen::Vector2d pixel_plus, pixel_minus;
        ASSERT_TRUE(Model(plus).project(point, &pixel_plus) && Model(minus).project(point, &pixel_minus));
        const Eigen::Vector2d numeric = (pixel_plus - pixel_minus) / (2.0 * step);
        EXPECT_LE((by_parameters.col(i) - numeric).norm(), 1e-5 * (1.0 + by_parameters.col(i).norm()))
            << Model::parameterNames()[i];
      }
    }
  });
}

TEST_P(CameraModelTest, ScaleOfThePointDoesNotMatter) {
  const auto& camera = GetParam().camera;
  Eigen::Vector2d near, far;
  const Eigen::Vector3d ray = direction(0.5, 1.0);
  ASSERT_TRUE(camera.project(1e-3 * ray, &near) && camera.project(1e6 * ray, &far));
  EXPECT_LE((near - far).norm(), 1e-8);
}

TEST_P(CameraModelTest, RejectsWhatHasNoImage) {
  const auto& camera = GetParam().camera;
  const Eigen::Vector2d untouched(-7.0, -7.0);
  const double nan = std::numeric_limits<double>::quiet_NaN();
  for (const Eigen::Vector3d& point : {Eigen::Vector3d(0.0, 0.0, 0.0), Eigen::Vector3d(0.0, 0.0, -1.0),
                                       Eigen::Vector3d(1e-12, 0.0, -1.0), Eigen::Vector3d(nan, 0.0, 1.0)}) {
    Eigen::Vector2d pixel = untouched;
    EXPECT_FALSE(camera.project(point, &pixel)) << point.transpose();
    EXPECT_EQ(pixel, untouched);
  }
  Eigen::Vector3d ray;
  EXPECT_FALSE(camera.unproject(Eigen::Vector2d(nan, 0.0), &ray));
}

TEST_P(CameraModelTest, ArraysGiveWhatSinglePointsGive) {
  const auto& camera = GetParam().camera;
  Eigen::Matrix3Xd points(3, 3);
  points << direction(0.3, 0.1), Eigen::Vector3d(0.0, 0.0, -1.0), direction(0.6, 2.0);
  Eigen::Matrix2Xd pixels;
  std::vector<uint8_t> valid;
  camera.project(points, &pixels, &valid);
  EXPECT_EQ(valid, (std::vector<uint8_t>{1, 0, 1}));
  Eigen::Vector2d single;
  ASSERT_TRUE(camera.project(points.col(2), &single));
  EXPECT_EQ(single, pixels.col(2));
  Eigen::Matrix3Xd rays;
  camera.unproject(pixels, &rays, &valid);
  EXPECT_EQ(valid[0], 1);
  EXPECT_LE(angleBetween(rays.col(0), points.col(0)), 1e-9);
}

TEST_P(CameraModelTest, IsRebuiltFromItsNameAndParameters) {
  const auto& camera = GetParam().camera;
  const CameraModel copy = CameraModel::create(camera.name(), camera.parameters());
  EXPECT_EQ(copy.parameters(), camera.parameters());
  EXPECT_EQ(copy.parameterNames().size(), static_cast<size_t>(camera.parameters().size()));
  Eigen::VectorXd bad = camera.parameters();
  bad[3] = std::numeric_limits<double>::quiet_NaN();
  EXPECT_THROW(CameraModel::create(camera.name(), bad), std::invalid_argument);
  EXPECT_THROW(CameraModel::create(camera.name(), Eigen::VectorXd::Ones(3)), std::invalid_argument);
}

INSTANTIATE_TEST_SUITE_P(AllModels, CameraModelTest, ::testing::ValuesIn(testCameras()),
                         [](const auto& test) { return test.param.label; });

TEST_P(CameraModelTest, MagnifiesAndShiftsTheImage) {
  const auto& [label, camera, max_angle_rad] = GetParam();
  const CameraModel moved = camera.withImage(1.01, Eigen::Vector2d(3.0, -2.0));
  EXPECT_EQ(moved.name(), camera.name());
  EXPECT_LT((moved.principalPoint() - camera.principalPoint() - Eigen::Vector2d(3.0, -2.0)).norm(), 1e-9);
  for (int i = 0; i < 8; ++i) {
    const Eigen::Vector3d ray = direction(0.8 * max_angle_rad, 0.8 * i);
    Eigen::Vector2d before, after;
    ASSERT_TRUE(camera.project(ray, &before) && moved.project(ray, &after)) << label;
    const Eigen::Vector2d expected = 1.01 * (before - camera.principalPoint());
    EXPECT_LT((after - moved.principalPoint() - expected).norm(), 1e-9) << label;
  }
}

TEST(CameraModelCreateTest, RejectsUnknownModels) {
  EXPECT_THROW(CameraModel::create("fisheye", Eigen::VectorXd::Ones(9)), std::invalid_argument);
}

}  // namespace
}  // namespace vcharge
