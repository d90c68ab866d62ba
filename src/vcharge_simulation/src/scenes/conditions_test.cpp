#include "vcharge_simulation/scenes/conditions.h"

#include <cmath>
#include <memory>

#include <gtest/gtest.h>
#include <tbb/global_control.h>

#include "lighting/lamp_light.h"
#include "lighting/vehicle_lamps.h"
#include "lighting/wet_ground.h"
#include "scenes/catalogue_cases.h"
#include "scenes/scene_builders.h"
#include "vcharge_simulation/drive/drive_scenario.h"
#include "vcharge_simulation/faults/exposure_faults.h"
#include "vcharge_simulation/sensors/golf_rig.h"
#include "vcharge_simulation/sensors/lens_glare.h"

namespace vcharge {
namespace {

ConditionOptions ofKind(ConditionKind kind) {
  ConditionOptions options;
  options.kind = kind;
  return options;
}

// Camera 6 m above the origin that looks straight down.
CameraView viewFromAbove() {
  RigCamera camera = makeGolfRig(1, 0.5).cameras[0];
  camera.vehicle_from_camera = RigidTransform(
      Eigen::Quaterniond(Eigen::AngleAxisd(3.14159265358979323846, Eigen::Vector3d::UnitX())), {0, 0, 6.0});
  return CameraView(camera, nullptr);
}

// Light of a point of the ground, seen by a camera of a car at the origin.
float lightAt(const CameraView& view, const cv::Mat& light, const Eigen::Vector3d& point_m) {
  const auto seen = findPoint(view, RigidTransform(), point_m.homogeneous());
  EXPECT_TRUE(seen.has_value()) << point_m.transpose();
  return seen ? light.at<float>(static_cast<int>(std::lround(seen->pixel.y())),
                                static_cast<int>(std::lround(seen->pixel.x())))
              : 0.0F;
}

TEST(ConditionsTest, NoonIsTheLightOfTheDayAndChangesNoFault) {
  LightOptions day;
  day.sun_azimuth_rad = 1.0;
  day.cloud_cover = 0.3;
  const Conditions noon = conditionsOf(ConditionOptions(), day);
  EXPECT_EQ(noon.light.sun_azimuth_rad, 1.0);
  EXPECT_EQ(noon.light.cloud_cover, 0.3);
  EXPECT_EQ(noon.wetness, 0.0);
  EXPECT_EQ(noon.headlight_cd, 0.0);
  EXPECT_FALSE(DriveScenario().activeFaults().auto_exposure.isActive());
  DriveScenario night;
  night.condition.kind = ConditionKind::kNight;
  EXPECT_TRUE(night.activeFaults().auto_exposure.isActive());
}

TEST(ConditionsTest, ShadowInALowSunLiesOppositeToItAndIsAsLongAsItsElevationSays) {
  ConditionOptions options = ofKind(ConditionKind::kLowSun);
  for (const double azimuth_rad : {0.15, 2.0, -1.2}) {
    options.sun_azimuth_rad = azimuth_rad;
    const Conditions conditions = conditionsOf(options);
    const std::shared_ptr<const Scene> plane = planeScene();
    Scene& scene = const_cast<Scene&>(*plane);  // NOLINT: this test's own scene
    scene.sky = std::make_unique<Sky>(conditions.light, 1);
    constexpr double kHeight_m = 0.5;
    addBox(placement(0.0, 0.0, 0.5 * kHeight_m, azimuth_rad), {0.02F, 1.0F, kHeight_m}, 0, &scene.mesh);
    const CameraView view = viewFromAbove();
    const cv::Mat light = Renderer(plane).renderLight(view, RigidTransform());
    const double length_m = kHeight_m / std::tan(options.sun_elevation_rad);
    const Eigen::Vector3d away(-std::cos(azimuth_rad), -std::sin(azimuth_rad), 0.0);
    const float sunlit = lightAt(view, light, -1.0 * away);
    EXPECT_LT(lightAt(view, light, 0.3 * away), 0.7F * sunlit);
    EXPECT_LT(lightAt(view, light, (length_m - 0.1) * away), 0.7F * sunlit);
    EXPECT_GT(lightAt(view, light, (length_m + 0.1) * away), 0.9F * sunlit);
  }
}

TEST(ConditionsTest, HeadlightsFallWithTheSquareOfTheDistanceAndEndAtTheCutOff) {
  const VehicleLamps lamps{0.2F, 1e-4F};
  const VehicleLamp& lamp = kVehicleLamps[0];
  for (const Eigen::Vector3f& direction :
       {Eigen::Vector3f(1.0F, 0.0F, -0.02F), Eigen::Vector3f(1.0F, 0.3F, -0.1F)}) {
    const Eigen::Vector3f ray = direction.normalized();
    const float near = vehicleLampIrradiance(lamps, lamp, lamp.position + 4.0F * ray);
    EXPECT_NEAR(vehicleLampIrradiance(lamps, lamp, lamp.position + 8.0F * ray), near / 4.0F, 1e-4F * near);
    EXPECT_NEAR(vehicleLampIrradiance(lamps, lamp, lamp.position + 20.0F * ray), near / 25.0F, 1e-4F * near);
  }
  // Straight ahead in the brightest direction, each lamp gives headlight / distance^2.
  const Eigen::Vector3f ahead(std::cos(0.02F), 0.0F, -std::sin(0.02F));
  EXPECT_NEAR(vehicleLampIrradiance(lamps, lamp, lamp.position + 10.0F * ahead), 0.2F / 100.0F, 1e-5F);
  EXPECT_LT(vehicleLampIrradiance(lamps, lamp, lamp.position + Eigen::Vector3f(10.0F, 0.0F, 0.3F)),
            0.02F * 0.2F / 100.0F);
  EXPECT_EQ(vehicleLampIrradiance(lamps, lamp, lamp.position - Eigen::Vector3f::UnitX()), 0.0F);
  EXPECT_NEAR(vehicleLampIrradiance(lamps, kVehicleLamps[2],
                                    kVehicleLamps[2].position - 2.0F * Eigen::Vector3f::UnitX()),
              1e-4F / 4.0F, 1e-9F);
}

TEST(ConditionsTest, HeadlightsLightTheGroundAheadAndAnObstacleShadowsIt) {
  const std::shared_ptr<const Scene> plane = planeScene();
  Scene& scene = const_cast<Scene&>(*plane);  // NOLINT: this test's own scene
  scene.sky = std::make_unique<Sky>(conditionsOf(ofKind(ConditionKind::kNight)).light, 1);
  scene.vehicle_lamps.headlight = 0.2F;
  RigCamera camera = makeGolfRig(1, 0.25).cameras[0];
  const CameraView view(camera, nullptr);
  const cv::Mat open = Renderer(plane).renderLight(view, RigidTransform());
  const Eigen::Vector3d ahead(9.0, 0.0, 0.0);
  const float lit = lightAt(view, open, ahead);
  // Irradiance of both lamps on level ground times the albedo of 0.5, through the lens.
  float expected = 0.0F;
  for (size_t i = 0; i < 2; ++i) {
    const Eigen::Vector3f offset = kVehicleLamps[i].position - ahead.cast<float>();
    expected += 0.5F * vehicleLampIrradiance(scene.vehicle_lamps, kVehicleLamps[i], ahead.cast<float>()) *
                offset.z() / offset.norm();
  }
  EXPECT_GT(lit, 0.6F * expected);
  EXPECT_LT(lit, 1.4F * expected);
  addBox(placement(5.5, 0.0, 0.25, 0.0), {0.1F, 2.0F, 0.5F}, 0, &scene.mesh);
  EXPECT_LT(lightAt(view, Renderer(plane).renderLight(view, RigidTransform()), {5.9, 0.0, 0.5}), 0.5F * lit);
}

TEST(ConditionsTest, LampMakesAPoolOfLightOnTheGround) {
  const std::shared_ptr<const Scene> plane = planeScene();
  Scene& scene = const_cast<Scene&>(*plane);  // NOLINT: this test's own scene
  Lamp lamp;
  lamp.centre = {1.0F, 0.0F, 5.0F};
  lamp.intensity = 0.02F;
  lamp.reach_m = 1000.0F;
  scene.lamps.push_back(lamp);
  bakeGroundLamps(
      {-20.0, -20.0}, {20.0, 20.0}, 0.2, [](double, double) { return 0.0; }, &scene);
  const auto irradiance = [&](float x) {
    const float root = scene.ground.lamps->sampleAt(x, 0.0F, 0.0F);
    return scene.ground.max_lamp_irradiance * root * root;
  };
  EXPECT_NEAR(irradiance(1.0F), 0.02F / 25.0F, 0.01F * 0.02F / 25.0F);
  EXPECT_GT(irradiance(1.0F), 2.0F * irradiance(6.0F));
  EXPECT_NEAR(irradiance(6.0F), irradiance(-4.0F), 0.05F * irradiance(6.0F));
}

TEST(ConditionsTest, WaterReflectsAsFresnelsEquationsSay) {
  constexpr double kIndex = 1.33;
  for (const double angle_rad : {0.0, 0.5, 1.0, 1.3, 1.5}) {
    const double refracted_rad = std::asin(std::sin(angle_rad) / kIndex);
    const double a = std::cos(angle_rad);
    const double b = std::cos(refracted_rad);
    const double s = std::pow((a - kIndex * b) / (a + kIndex * b), 2);
    const double p = std::pow((b - kIndex * a) / (b + kIndex * a), 2);
    EXPECT_NEAR(waterReflectance(static_cast<float>(a)), 0.5 * (s + p), 1e-4) << angle_rad;
  }
  EXPECT_EQ(waterReflectance(0.0F), 1.0F);
}

TEST(ConditionsTest, WetGroundMirrorsAWallMoreTheMoreItsGrazingAndDryGroundDoesNot) {
  const auto build = [](float wetness) {
    const std::shared_ptr<const Scene> plane = planeScene();
    Scene& scene = const_cast<Scene&>(*plane);  // NOLINT: this test's own scene
    LightOptions dark;
    dark.sun_irradiance = dark.sky_irradiance = dark.bounce_irradiance = 0.0;
    scene.sky = std::make_unique<Sky>(dark, 1);
    scene.materials[0].wetness = wetness;
    Material glowing;
    glowing.emission = 4.0F;
    glowing.two_sided = true;
    addBox(placement(20.0, 0.0, 20.0, 0.0), {0.1F, 200.0F, 40.0F}, scene.addMaterial(glowing), &scene.mesh);
    return plane;
  };
  RigCamera camera = makeGolfRig(1, 0.5).cameras[0];
  const CameraView view(camera, nullptr);
  const cv::Mat wet = Renderer(build(1.0F)).renderLight(view, RigidTransform());
  const cv::Mat dry = Renderer(build(0.0F)).renderLight(view, RigidTransform());
  const double height_m = camera.vehicle_from_camera->translation().z();
  float last = 0.0F;
  for (const double distance_m : {2.0, 4.0, 8.0}) {
    const Eigen::Vector3d point(camera.vehicle_from_camera->translation().x() + distance_m, 0.0, 0.0);
    const float reflected = lightAt(view, wet, point) - lightAt(view, dry, point);
    const float whole =
        4.0F * waterReflectance(static_cast<float>(height_m / std::hypot(height_m, distance_m)));
    // Between a film with grains that stick out and a puddle; ripples change the angle.
    EXPECT_GT(reflected, 0.15F * whole) << distance_m;
    EXPECT_LT(reflected, 1.3F * whole) << distance_m;
    EXPECT_GT(reflected, last);
    last = reflected;
  }
}

TEST(ConditionsTest, NightIsNoisierThanNoon) {
  const auto noiseOf = [](const DriveScenario& scenario, double light_level) {
    const CameraResponse response;
    const cv::Mat light(120, 160, CV_32FC1, cv::Scalar(light_level));
    ExposureFaults exposures(scenario.activeFaults(), {"front"}, response, Timestamp());
    const cv::Mat image = response.addNoise(light, 1, 0, 0, exposures.next(0, Timestamp(), light));
    cv::Scalar mean, deviation;
    cv::meanStdDev(image, mean, deviation);
    return std::pair(mean[0], deviation[0]);
  };
  DriveScenario night;
  night.condition.kind = ConditionKind::kNight;
  const auto [day_mean, day_noise] = noiseOf(DriveScenario(), 0.2);
  const auto [night_mean, night_noise] = noiseOf(night, 0.2 * 2e-4);  // under a lamp
  EXPECT_GT(night_mean, 0.4 * day_mean);
  EXPECT_GT(night_noise, 3.0 * day_noise);
}

TEST(ConditionsTest, SunInTheImageGlaresUnlessAHouseHidesIt) {
  const std::shared_ptr<const Scene> plane = planeScene();
  Scene& scene = const_cast<Scene&>(*plane);  // NOLINT: this test's own scene
  ConditionOptions options = ofKind(ConditionKind::kLowSun);
  scene.sky = std::make_unique<Sky>(conditionsOf(options).light, 1);
  const CameraView view(makeGolfRig(1, 0.25).cameras[0], nullptr);
  cv::Mat open = cv::Mat::zeros(view.size(), CV_32FC1);
  LensGlare(scene, [](const Eigen::Vector3d&, const Eigen::Vector4d&) {
    return true;
  }).apply(view, RigidTransform(), &open);
  cv::Mat hidden = cv::Mat::zeros(view.size(), CV_32FC1);
  LensGlare(scene, [](const Eigen::Vector3d&, const Eigen::Vector4d&) {
    return false;
  }).apply(view, RigidTransform(), &hidden);
  EXPECT_EQ(cv::countNonZero(hidden), 0);
  cv::Point brightest;
  cv::minMaxLoc(open, nullptr, nullptr, nullptr, &brightest);
  const Eigen::Vector3d towards =
      view.camera().vehicle_from_camera->rotation() * view.centreRay(brightest.x, brightest.y).cast<double>();
  EXPECT_NEAR(std::asin(towards.z()), options.sun_elevation_rad, 0.02);
  EXPECT_NEAR(std::atan2(towards.y(), towards.x()), options.sun_azimuth_rad, 0.02);
}

TEST(ConditionsTest, AWetNightChangesNoRangeAndIsTheSameOnAnyNumberOfThreads) {
  SceneOptions options;
  options.image_scale = 0.3;
  options.detail = 0.25;  // as rendererOf()
  options.condition = ofKind(ConditionKind::kNight);
  options.condition.wetness = 1.0;
  for (const char* name : {"lot", "garage"}) {
    const Renderer night(buildScene(name, options));
    const CameraView view(makeGolfRig(1, 0.2).cameras[0], makeGolfBody());
    const RigidTransform pose = RigidTransform::planar(-5.0, 0.2, 0.1);
    const cv::Mat many = night.renderLight(view, pose);
    {
      const tbb::global_control limit(tbb::global_control::max_allowed_parallelism, 1);
      EXPECT_EQ(cv::norm(many, night.renderLight(view, pose), cv::NORM_INF), 0.0);
    }
    cv::Mat ranges_m[] = {night.renderRange(view, pose), rendererOf(name).renderRange(view, pose)};
    for (cv::Mat& range_m : ranges_m) {
      cv::patchNaNs(range_m, -1.0);
    }
    EXPECT_EQ(cv::norm(ranges_m[0], ranges_m[1], cv::NORM_INF), 0.0);
    EXPECT_GT(cv::norm(many, rendererOf(name).renderLight(view, pose), cv::NORM_INF), 0.05);
  }
}

}  // namespace
}  // namespace vcharge
