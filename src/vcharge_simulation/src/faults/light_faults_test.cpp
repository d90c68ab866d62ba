#include "vcharge_simulation/faults/light_faults.h"

#include <algorithm>
#include <cmath>

#include <gtest/gtest.h>

namespace vcharge {
namespace {

const cv::Size kSize(128, 80);
constexpr size_t kFront = 0;
constexpr size_t kLeft = 1;

Timestamp start() {
  return Timestamp::fromNanoseconds(1'400'000'000'000'000'000);
}

Timestamp stampOf(int frame) {
  return start() + std::chrono::milliseconds(7 + 80 * frame);
}

// The front and the left camera of a small rig with these faults.
struct Cameras {
  explicit Cameras(const std::string& text, const LightFaults::IsVisible& is_visible = nullptr)
      : scenario(read(text)),
        recorded(scenario, "masks"),
        faults(scenario.faults, recorded, CameraResponse(), start(), is_visible) {}

  static DriveScenario read(const std::string& text) {
    DriveScenario scenario;
    scenario.image_scale = 0.1;
    scenario.cameras = {"front", "left"};
    readFields(YAML::Load(text), "faults.yaml", &scenario.faults);
    return scenario;
  }
  cv::Mat apply(size_t camera, int frame, const cv::Mat& clean,
                const Readout& readout = RigidTransform()) const {
    return faults.apply(camera, stampOf(frame), clean, readout);
  }

  DriveScenario scenario;
  RecordedCameras recorded;
  LightFaults faults;
};

double lightFromGray(double gray) {
  return CameraResponse().lightFromGray(gray);
}

bool equal(const cv::Mat& a, const cv::Mat& b) {
  return a.size() == b.size() && a.type() == b.type() && cv::norm(a, b, cv::NORM_INF) == 0.0;
}

cv::Mat uniform(int gray) {
  return cv::Mat(kSize, CV_8UC1, cv::Scalar(gray));
}

TEST(LightFaultsTest, ImagesPassUnchangedWithoutAFault) {
  const Cameras cameras("vignetting: {cameras: [left], start_s: 0.2}");
  EXPECT_TRUE(equal(cameras.apply(kLeft, 0, uniform(90)), uniform(90)));
  EXPECT_TRUE(equal(cameras.apply(kFront, 5, uniform(90)), uniform(90)));
  EXPECT_FALSE(equal(cameras.apply(kLeft, 5, uniform(90)), uniform(90)));
}

TEST(LightFaultsTest, SunSaturatesItsDiskAndVeilsTheRestLessAndLess) {
  const Cameras cameras("sun_glare: {cameras: [left], x: 0.25, y: 0.5}");
  const cv::Mat blinded = CameraResponse().develop(cameras.apply(kLeft, 5, uniform(30)));
  const auto gray = [&](int x) { return static_cast<int>(blinded.at<uint8_t>(40, x)); };
  EXPECT_EQ(gray(32), 255);
  EXPECT_LT(gray(60), 255);
  EXPECT_GT(gray(60), gray(90));
  EXPECT_GT(gray(90), gray(127));
  EXPECT_GT(gray(127), 40);
}

TEST(LightFaultsTest, DirtIsABrightLineAndBlobsThatStayInPlace) {
  const auto dirty = [](const std::string& options, int frame) {
    return Cameras("dirty_lens: {cameras: [left], blobs: 6" + options + "}")
        .apply(kLeft, frame, uniform(120));
  };
  EXPECT_TRUE(equal(dirty("", 0), dirty("", 9)));
  EXPECT_FALSE(equal(dirty("", 0), dirty(", seed: 2", 0)));
  // The line crosses every column; blobs darken a part of the image.
  const cv::Mat gray = CameraResponse().develop(dirty("", 0));
  for (int x = 0; x < kSize.width; ++x) {
    double brightest = 0.0;
    cv::minMaxLoc(gray.col(x), nullptr, &brightest);
    EXPECT_GT(brightest, 140.0) << x;
  }
  const double darkened = static_cast<double>(cv::countNonZero(gray < 110)) / kSize.area();
  EXPECT_GT(darkened, 0.002);
  EXPECT_LT(darkened, 0.2);
}

// Behind the blobs a blur removes stripes; elsewhere, and in uniform images, it changes nothing.
TEST(LightFaultsTest, DirtBlursOnlyWhatIsBehindItsBlobs) {
  const Cameras sharp("dirty_lens: {cameras: [left], blobs: 8}");
  const Cameras blurred("dirty_lens: {cameras: [left], blobs: 8, blur_px: 50}");
  EXPECT_LT(cv::norm(sharp.apply(kLeft, 0, uniform(90)), blurred.apply(kLeft, 0, uniform(90)), cv::NORM_INF),
            1e-5);
  cv::Mat stripes = uniform(60);
  for (int x = 0; x < kSize.width; x += 2) {
    stripes.col(x).setTo(120);
  }
  const cv::Mat passed = sharp.apply(kLeft, 0, stripes);
  const cv::Mat smeared = blurred.apply(kLeft, 0, stripes);
  int unchanged = 0;
  int smooth = 0;
  for (int y = 0; y < kSize.height; ++y) {
    for (int x = 0; x + 1 < kSize.width; ++x) {
      const float contrast = std::abs(passed.at<float>(y, x + 1) - passed.at<float>(y, x));
      const float left = std::abs(smeared.at<float>(y, x + 1) - smeared.at<float>(y, x));
      unchanged += std::abs(left - contrast) < 0.01F * contrast ? 1 : 0;
      smooth += left < 0.2F * contrast ? 1 : 0;
    }
  }
  EXPECT_GT(unchanged, 0.7 * kSize.area());
  EXPECT_GT(smooth, 20);
}

TEST(LightFaultsTest, VignettingFollowsTheFourthPowerOfTheCosine) {
  constexpr double kRimLoss = 0.6;
  const Cameras cameras("vignetting: {cameras: [left], rim_loss: 0.6}");
  const cv::Mat light = cameras.apply(kLeft, 0, uniform(90));
  const RigCamera& camera = cameras.recorded.rig().cameras[kLeft];
  const double rim_rad = 0.5 * camera.field_of_view_rad;
  // The angle at whose tangent cos^4 has fallen by the loss.
  const double rim_tangent = std::tan(std::acos(std::pow(1.0 - kRimLoss, 0.25)));
  double nearest_rim_rad = 0.0;
  for (int y = 0; y < kSize.height; ++y) {
    for (int x = 0; x < kSize.width; ++x) {
      Eigen::Vector3d ray;
      if (!camera.model.unproject(Eigen::Vector2d(x, y), &ray) || std::acos(ray.z()) > 0.99 * rim_rad) {
        continue;
      }
      const double angle_rad = std::acos(ray.z());
      const double expected = std::pow(std::cos(std::atan(rim_tangent * angle_rad / rim_rad)), 4.0);
      EXPECT_NEAR(light.at<float>(y, x) / lightFromGray(90), expected, 1e-4);
      nearest_rim_rad = std::max(nearest_rim_rad, angle_rad);
    }
  }
  EXPECT_GT(nearest_rim_rad, 0.95 * rim_rad);
}

TEST(LightFaultsTest, DropShowsItsSurroundingsInvertedReducedAndBlurred) {
  const Cameras cameras("water_drop: {cameras: [left], x: 0.5, y: 0.5, radius: 0.2}");
  constexpr double kCentre = 63.5;
  constexpr double kRadius_px = 0.2 * 128;
  // An edge to the right of the drop's centre: dark left of column 82.
  constexpr int kEdge = 82;
  cv::Mat edge = uniform(30);
  edge.colRange(kEdge, kSize.width).setTo(120);
  const cv::Mat light = cameras.apply(kLeft, 0, edge);
  const double dark = lightFromGray(30);
  const double bright = lightFromGray(120);
  // Outside the drop nothing changes.
  for (int y = 0; y < kSize.height; ++y) {
    for (int x = 0; x < kSize.width; ++x) {
      if (std::hypot(x - kCentre, y - 39.5) > kRadius_px) {
        ASSERT_NEAR(light.at<float>(y, x), x < kEdge ? dark : bright, 1e-5) << x << ", " << y;
      }
    }
  }
  // Inside, a third as far on the other side, the light is that from beyond the edge.
  double seen = 0.0;
  constexpr int kFirst = 48;
  constexpr int kLast = 66;
  double spread = 0.0;
  const double shown_edge = kCentre - (kEdge - 0.5 - kCentre) / 3.0;
  for (int x = kFirst; x < kLast; ++x) {
    const double fraction = (light.at<float>(40, x) - dark) / (bright - dark);
    const double next = (light.at<float>(40, x + 1) - dark) / (bright - dark);
    seen += fraction;
    spread += (fraction - next) * (x + 0.5 - shown_edge) * (x + 0.5 - shown_edge);
  }
  EXPECT_NEAR(kFirst - 0.5 + seen, shown_edge, 0.3);
  EXPECT_NEAR(std::sqrt(spread), 0.08 * kRadius_px, 0.3);
}

TEST(LightFaultsTest, LowLightDimsTheSceneButNotTheSun) {
  const Cameras dark("{low_light: {level: 0.02}, sun_glare: {cameras: [left]}}");
  const Cameras day("sun_glare: {cameras: [left]}");
  EXPECT_NEAR(dark.apply(kFront, 0, uniform(90)).at<float>(40, 40), 0.02 * lightFromGray(90), 1e-7);
  const cv::Mat difference = day.apply(kLeft, 0, uniform(90)) - dark.apply(kLeft, 0, uniform(90));
  EXPECT_NEAR(cv::mean(difference)[0], 0.98 * lightFromGray(90), 1e-5);
}

std::string lampAt(const Eigen::Vector3d& lamp_m, double intensity_cd) {
  return "bright_lamps: {cameras: [left], intensity_cd: " + std::to_string(intensity_cd) +
         ", positions_m: [" + std::to_string(lamp_m.x()) + ", " + std::to_string(lamp_m.y()) + ", " +
         std::to_string(lamp_m.z()) + "]}";
}

// A lamp 5 m away in the direction of a pixel of the left camera.
Eigen::Vector3d lampAhead(const RigidTransform& world_from_vehicle, const Eigen::Vector2d& pixel) {
  const Cameras cameras("{}");
  const RigCamera& camera = cameras.recorded.rig().cameras[kLeft];
  Eigen::Vector3d ray;
  EXPECT_TRUE(camera.model.unproject(pixel, &ray));
  return world_from_vehicle * (*camera.vehicle_from_camera * (5.0 * ray).eval());
}

cv::Point brightest(const cv::Mat& light) {
  cv::Point at;
  cv::minMaxLoc(light, nullptr, nullptr, nullptr, &at);
  return at;
}

TEST(LightFaultsTest, LampShinesWhereItIsAndFarFromItLikeASunOfItsIlluminance) {
  const RigidTransform world_from_vehicle = RigidTransform::planar(3.0, -2.0, 0.7);
  constexpr double kDistance_m = 5.0;
  constexpr double kIlluminance_lx = 200.0;
  const Eigen::Vector2d pixel(50.0, 30.0);
  const Cameras lamp(
      lampAt(lampAhead(world_from_vehicle, pixel), kIlluminance_lx * kDistance_m * kDistance_m));
  const Cameras sun("sun_glare: {cameras: [left], x: " + std::to_string(50.5 / kSize.width) +
                    ", y: " + std::to_string(30.5 / kSize.height) + "}");
  const cv::Mat by_lamp = lamp.apply(kLeft, 0, uniform(0), world_from_vehicle);
  const cv::Mat by_sun = sun.apply(kLeft, 0, uniform(0));
  EXPECT_EQ(brightest(by_lamp), cv::Point(50, 30));
  for (const int x : {90, 110, 127}) {
    // Beyond ten radii of the sun (4 px at this scale), 1 + r^2 is r^2 within 1 %.
    EXPECT_NEAR(by_lamp.at<float>(30, x), kIlluminance_lx / 1e5 * by_sun.at<float>(30, x),
                0.011 * by_lamp.at<float>(30, x));
  }
  EXPECT_TRUE(equal(lamp.apply(kFront, 0, uniform(0), world_from_vehicle), uniform(0)));
}

TEST(LightFaultsTest, DiskOfALampGrowsWithTheRootOfItsIntensity) {
  const auto saturatedPixels = [](double intensity_cd) {
    const Cameras cameras("bright_lamps: {cameras: [left], image_positions: [0.5, 0.5], intensity_cd: " +
                          std::to_string(intensity_cd) + "}");
    return cv::countNonZero(CameraResponse().develop(cameras.apply(kLeft, 0, uniform(0))) == 255);
  };
  const int small = saturatedPixels(2e6);
  EXPECT_GT(small, 100);
  EXPECT_NEAR(static_cast<double>(saturatedPixels(8e6)) / small, 4.0, 0.3);
}

TEST(LightFaultsTest, LampBehindAWallOrTheOwnCarDoesNotShine) {
  const RigidTransform standing;
  const std::string lamp = lampAt(lampAhead(standing, {50.0, 30.0}), 1e4);
  const Cameras hidden(lamp, [](const Eigen::Vector3d&, const Eigen::Vector3d&) { return false; });
  EXPECT_EQ(cv::countNonZero(hidden.apply(kLeft, 0, uniform(0), standing)), 0);
  const cv::Mat mask = Cameras("{}").recorded.view(kLeft, Duration(0)).mask();
  cv::Point own(-1, -1);
  for (int y = 0; y < kSize.height; ++y) {
    for (int x = 0; x < kSize.width; ++x) {
      own = mask.at<uint8_t>(y, x) == 0 ? cv::Point(x, y) : own;
    }
  }
  ASSERT_GE(own.x, 0);
  const Cameras behind_body(
      lampAt(lampAhead(standing, {static_cast<double>(own.x), static_cast<double>(own.y)}), 1e4));
  EXPECT_EQ(cv::countNonZero(behind_body.apply(kLeft, 0, uniform(0), standing)), 0);
}

TEST(LightFaultsTest, LampMovesWithTheRowsOfARollingShutter) {
  // The car turns about its origin at 3 rad/s.
  std::vector<RigidTransform> poses;
  for (int ms = -20; ms <= 20; ++ms) {
    poses.push_back(RigidTransform::planar(0.0, 0.0, 3e-3 * ms));
  }
  const Readout readout(MotionWindow(poses), 0.03);
  constexpr int kRow = 12;
  // A lamp that is in this pixel while its row is exposed.
  const Eigen::Vector3d lamp_m =
      lampAhead(readout.motion.at(0.03 * ((kRow + 0.5) / kSize.height - 0.5)), {60.0, kRow});
  const Cameras cameras(lampAt(lamp_m, 1e4));
  EXPECT_EQ(brightest(cameras.apply(kLeft, 0, uniform(0), readout)), cv::Point(60, kRow));
  EXPECT_NE(brightest(cameras.apply(kLeft, 0, uniform(0), readout.motion.at(0.0))), cv::Point(60, kRow));
}

}  // namespace
}  // namespace vcharge
