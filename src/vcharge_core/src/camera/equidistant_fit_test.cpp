#include "vcharge_core/camera/equidistant_fit.h"

#include <algorithm>
#include <cmath>

#include <gtest/gtest.h>

namespace vcharge {
namespace {

constexpr double kFieldOfView_rad = 3.2289;  // 185 degrees

KannalaBrandtCamera someKannalaBrandt() {
  KannalaBrandtCamera::Parameters parameters;
  parameters << 390.0, 393.0, 640.0, 397.0, -0.02, 0.004, -0.001, 0.0001;
  return KannalaBrandtCamera(parameters);
}

TEST(EquidistantFitTest, FindsAnEquidistantCameraAgain) {
  const KannalaBrandtCamera truth = someKannalaBrandt();
  const EquidistantFit fit = fitEquidistant(truth, cv::Size(1280, 800), 3.0);
  EXPECT_LT(fit.max_px, 1e-6);
  EXPECT_LT((fit.camera.parameters() - truth.parameters()).cwiseAbs().maxCoeff(), 1e-6);
}

// r(theta) = f tan(theta / 2) is the unified model with xi = 1 (and gamma = f): stereographic.
TEST(EquidistantFitTest, ResidualIsTheDistanceBetweenTheTwoModels) {
  const double focal = 300.0;
  const cv::Size size(1280, 800);
  const MeiCamera camera(1.0, 2.0 * focal, 2.0 * focal, 639.5, 399.5);
  const EquidistantFit fit = fitEquidistant(camera, size, kFieldOfView_rad);
  double max_px = 0.0;
  for (double theta = 0.0; theta < 0.5 * kFieldOfView_rad; theta += 0.01) {
    for (double phi = 0.0; phi < 6.2; phi += 0.1) {
      const double r = 2.0 * focal * std::tan(0.5 * theta);
      const Eigen::Vector2d truth(639.5 + r * std::cos(phi), 399.5 + r * std::sin(phi));
      if (truth.x() < 0 || truth.x() > size.width - 1 || truth.y() < 0 || truth.y() > size.height - 1) {
        continue;
      }
      Eigen::Vector2d pixel;
      ASSERT_TRUE(fit.camera.project(
          Eigen::Vector3d(std::sin(theta) * std::cos(phi), std::sin(theta) * std::sin(phi), std::cos(theta)),
          &pixel));
      max_px = std::max(max_px, (pixel - truth).norm());
    }
  }
  // The two maxima are taken over different pixels.
  EXPECT_NEAR(fit.max_px, max_px, 0.2 * max_px + 1e-3);
  EXPECT_LT(fit.rms_px, fit.max_px);
  // The four coefficients match the series of the tangent up to theta^9; the next term is 2 f (theta / 2)^11
  // * 1382/155925.
  EXPECT_LT(fit.max_px, 2.0 * focal * std::pow(0.25 * kFieldOfView_rad, 11) * 1382.0 / 155925.0);
}

TEST(EquidistantFitTest, RefusesAFieldOfViewWithoutPixels) {
  EXPECT_THROW(fitEquidistant(someKannalaBrandt(), cv::Size(1280, 800), 0.001), std::invalid_argument);
}

}  // namespace
}  // namespace vcharge
