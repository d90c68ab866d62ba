#include "masks/scene_levels.h"

#include <cmath>

#include <gtest/gtest.h>

#include "vcharge_core/camera/kannala_brandt_camera.h"

namespace vcharge::internal {
namespace {

constexpr float kGroundLevel = 0.05F, kThingsLevel = 0.3F, kSkyLevel = 0.01F, kBodyLevel = 0.02F;

SmallView wideView() {
  KannalaBrandtCamera::Parameters parameters;
  parameters << 190.0, 190.0, 320.0, 200.0, 0.0, 0.0, 0.0, 0.0;
  RigCamera camera{"left", "camera_left_optical", cv::Size(640, 400), KannalaBrandtCamera(parameters)};
  camera.field_of_view_rad = 3.1;
  return makeSmallView(camera);
}

/// Way down of a camera that looks down by `pitch_rad` and is rolled clockwise by `roll_rad`.
cv::Vec3f downOf(double pitch_rad, double roll_rad) {
  return cv::Vec3f(static_cast<float>(std::cos(pitch_rad) * std::sin(roll_rad)),
                   static_cast<float>(std::cos(pitch_rad) * std::cos(roll_rad)),
                   static_cast<float>(std::sin(pitch_rad)));
}

/// Ground, things from 6 degrees below the horizon to 30 above, sky; a body in the leftmost columns.
StaticStructure structureOf(const SmallView& view, const cv::Vec3f& down, int body_columns) {
  StaticStructure structure;
  structure.edge_x = cv::Mat(view.size, CV_32FC1, cv::Scalar(0.03));
  structure.edge_y = cv::Mat(view.size, CV_32FC1, cv::Scalar(0.04));
  structure.edge = cv::Mat(view.size, CV_32FC1, cv::Scalar(0.05));
  structure.moving = cv::Mat(view.size, CV_32FC1, cv::Scalar(0.0));
  for (int y = 0; y < view.size.height; ++y) {
    for (int x = 0; x < view.size.width; ++x) {
      const float elevation_rad = std::asin(-view.rays.at<cv::Vec3f>(y, x).dot(down));
      structure.moving.at<float>(y, x) = x < body_columns        ? kBodyLevel
                                         : elevation_rad < -0.1F ? kGroundLevel
                                         : elevation_rad < 0.52F ? kThingsLevel
                                                                 : kSkyLevel;
    }
  }
  structure.typical_moving = kGroundLevel;
  return structure;
}

TEST(SceneLevelsTest, FindsTheVerticalOfTiltedAndRolledCameras) {
  const SmallView view = wideView();
  for (const double pitch_rad : {-0.2, 0.0, 0.3, 0.7}) {
    for (const double roll_rad : {-0.3, 0.0, 0.2}) {
      const cv::Vec3f down = downOf(pitch_rad, roll_rad);
      const SceneLevels levels = findSceneLevels(view, structureOf(view, down, 60));
      EXPECT_GT(levels.down.dot(down), std::cos(0.05)) << pitch_rad << " " << roll_rad;
    }
  }
}

TEST(SceneLevelsTest, TellsWhatTheSceneShowsBehindTheBody) {
  const SmallView view = wideView();
  const SceneLevels levels = findSceneLevels(view, structureOf(view, downOf(0.3, 0.0), 120));
  const auto levelAt = [&](double elevation_deg) {
    // In the column of the body whose ray is nearest to 70 degrees left of the axis.
    for (int y = 0; y < view.size.height; ++y) {
      if (std::abs(levels.elevation_rad.at<float>(y, 90) * 180.0 / CV_PI - elevation_deg) < 1.0) {
        return levels.moving.at<float>(y, 90);
      }
    }
    return -1.0F;
  };
  EXPECT_FLOAT_EQ(levelAt(-25.0), kGroundLevel);
  EXPECT_FLOAT_EQ(levelAt(10.0), kThingsLevel);
}

TEST(SceneLevelsTest, TakesTheLevelOfTheWholeGroundWhereTheBodyFillsIt) {
  const SmallView view = wideView();
  StaticStructure structure = structureOf(view, downOf(0.3, 0.0), 0);
  structure.moving.rowRange(330, 400).setTo(kBodyLevel);
  const SceneLevels levels = findSceneLevels(view, structure);
  EXPECT_FLOAT_EQ(levels.moving.at<float>(380, 320), kGroundLevel);
}

TEST(SceneLevelsTest, MeasuresTheNoiseOfEdges) {
  const SmallView view = wideView();
  const SceneLevels levels = findSceneLevels(view, structureOf(view, downOf(0.3, 0.0), 0));
  // All edges have the length 0.05, which is taken for a quantile of a Rayleigh distribution.
  EXPECT_NEAR(levels.edge_noise.at<float>(100, 320), 0.05 / 1.0108, 1e-4);
  EXPECT_NEAR(levels.edge_noise.at<float>(350, 320), 0.05 / 0.5701, 1e-4);
}

}  // namespace
}  // namespace vcharge::internal
