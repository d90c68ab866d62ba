#include "vcharge_obstacles/ground_watch.h"

#include <algorithm>
#include <cmath>
#include <functional>
#include <random>

#include <gtest/gtest.h>

#include "detection/box_world.h"
#include "vcharge_core/camera/ray_table.h"

namespace vcharge {
namespace {

constexpr double kDegree = M_PI / 180.0;
constexpr double kStep_s = 0.24;

/// Brightness pattern, smooth over some centimetres: a sum of waves in random directions.
class Pattern {
 public:
  Pattern(double mean, uint32_t seed) : mean_(mean) {
    std::mt19937 generator(seed);
    std::uniform_real_distribution<double> angle(0.0, 2.0 * M_PI), length(0.15, 0.6);
    for (Eigen::Vector4d& wave : waves_) {
      const double direction = angle(generator);
      const double frequency = 2.0 * M_PI / length(generator);
      wave = {frequency * std::cos(direction), frequency * std::sin(direction),
              frequency * std::sin(direction + 1.0), angle(generator)};
    }
  }
  double at(const Eigen::Vector3d& point_m) const {
    double sum = mean_;
    for (const Eigen::Vector4d& wave : waves_) {
      sum += 6.0 * std::sin(wave.head<3>().dot(point_m) + wave.w());
    }
    return sum;
  }

 private:
  double mean_;
  std::array<Eigen::Vector4d, 6> waves_;
};

/// Images of textured ground and boxes from a camera of the box world's rig.
class GroundWatchTest : public ::testing::Test {
 protected:
  GroundWatchTest()
      : working_(camera_.model, camera_.image_size_px, camera_.field_of_view_rad, camera_.mask, scale()),
        watch_(working_, *camera_.vehicle_from_camera, grid_, 7.0) {}

  static WorkingCameraOptions scale() {
    WorkingCameraOptions options;
    options.image_scale = 1.0;
    return options;
  }
  cv::Mat takeImage(const BoxWorld& world, const RigidTransform& world_from_body) {
    const RayTable rays(working_.model(), working_.size(), 2.0 * M_PI, working_.validMask());
    const RigidTransform world_from_camera = world_from_body * *camera_.vehicle_from_camera;
    cv::Mat image(working_.size(), CV_8UC1, cv::Scalar(0));
    for (int y = 0; y < image.rows; ++y) {
      for (int x = 0; x < image.cols; ++x) {
        if (!rays.valid(x, y)) {
          continue;
        }
        const Eigen::Vector3d direction = world_from_camera.rotation() * rays.ray(x, y).cast<double>();
        const Eigen::Vector3d& origin = world_from_camera.translation();
        const double range_m = world.castRay(origin, direction);
        const Eigen::Vector3d point_m = origin + range_m * direction;
        const double light = light_ ? light_(world_from_body.inverse() * point_m) : 1.0;
        const double brightness = !std::isfinite(range_m) ? 230.0
                                  : point_m.z() > 1e-6    ? box_.at(point_m)
                                                          : light * ground_.at(point_m);
        image.at<uint8_t>(y, x) = cv::saturate_cast<uint8_t>(gain_ * brightness + noise_(generator_));
      }
    }
    return image;
  }
  /// Changed fractions after two images, with the body pitched in the second one.
  std::vector<float> compare(const BoxWorld& first, const BoxWorld& second, double pitch_rad = 0.0) {
    watch_.clear();
    GroundPlane level;
    level.state = GroundState::kMeasured;
    EXPECT_TRUE(watch_.compare(Timestamp(), takeImage(first, poseAt(0.0, 0.0)), level, poseAt(0.0, 0.0))
                    .changed_fraction.empty());
    GroundPlane tilted = level;
    tilted.slope.x() = std::tan(pitch_rad);
    const GroundAppearance appearance =
        watch_.compare(Timestamp() + durationFromSeconds(kStep_s), takeImage(second, poseAt(0.2, pitch_rad)),
                       tilted, poseAt(0.2, 0.0));
    ground_pixels_ = appearance.ground_pixels;
    return appearance.changed_fraction;
  }
  static RigidTransform poseAt(double x_m, double pitch_rad) {
    return RigidTransform(rotationFromYawPitchRoll(0.0, pitch_rad, 0.0), Eigen::Vector3d(x_m, 0.0, 0.0));
  }
  /// Changed fraction of the ground at a point, seen from the second pose.
  double fractionAt(const std::vector<float>& changed, double x_m, double y_m) const {
    const Eigen::Vector2d offset =
        Eigen::Vector2d(x_m - 0.2, y_m) - camera_.vehicle_from_camera->translation().head<2>();
    const int bin = grid_.binOfInverse(static_cast<float>(1.0 / offset.norm()));
    return changed.at(grid_.index(grid_.rayOf(std::atan2(offset.y(), offset.x())), bin));
  }
  /// Mean changed fraction of bare ground to the left, up to 3 m from the camera.
  double meanFraction(const std::vector<float>& changed) const {
    double sum = 0.0;
    int count = 0;
    for (double x = 1.0; x < 3.5; x += 0.1) {
      for (double y = 1.5; y < 3.5; y += 0.1) {
        sum += fractionAt(changed, x, y);
        ++count;
      }
    }
    return sum / count;
  }

  const RigCamera camera_ = makeBoxWorldRig().cameras[1];
  const PolarGrid grid_{PolarGridOptions()};
  const WorkingCamera working_;
  GroundWatch watch_;
  const Pattern ground_{110.0, 1}, box_{60.0, 2};
  std::vector<float> ground_pixels_;  // of the last comparison
  double gain_ = 1.0;
  std::function<double(const Eigen::Vector3d& point_in_vehicle_m)>
      light_;  // on the ground; null: 1 everywhere
  std::mt19937 generator_{3};
  std::normal_distribution<double> noise_{0.0, 2.0};
};

BoxWorld personAt(double x_m) {
  return {{{{x_m - 0.2, 2.6, 0.0}, {x_m + 0.2, 3.0, 1.7}}}};
}

TEST_F(GroundWatchTest, BareGroundIsUnchanged) {
  const std::vector<float> changed = compare({}, {});
  ASSERT_EQ(changed.size(), grid_.size());
  EXPECT_LT(meanFraction(changed), 0.02);
}

TEST_F(GroundWatchTest, GroundUnderAnArrivingPersonIsChanged) {
  const std::vector<float> changed = compare({}, personAt(2.2));
  for (const double y : {2.65, 2.8, 3.0, 3.4}) {  // under the person, and hidden by the person
    EXPECT_GT(fractionAt(changed, 2.2 + 0.1 * (y - 2.65), y), 0.5) << y;
  }
  EXPECT_LT(fractionAt(changed, 2.2, 2.2), 0.1);  // in front of the person
}

TEST_F(GroundWatchTest, PersonWalkingAlongsideIsDetectedWithoutARange) {
  const std::vector<float> changed =
      compare(personAt(2.2), personAt(2.4));  // as fast as the vehicle, so without parallax
  EXPECT_GT(fractionAt(changed, 2.55, 2.65), 0.5);
}

TEST_F(GroundWatchTest, ChangeOfExposureIsNoChangeOfTheGround) {
  GroundPlane level;
  level.state = GroundState::kMeasured;
  watch_.compare(Timestamp(), takeImage({}, poseAt(0.0, 0.0)), level, poseAt(0.0, 0.0));
  gain_ = 1.3;
  EXPECT_LT(meanFraction(watch_
                             .compare(Timestamp() + durationFromSeconds(kStep_s),
                                      takeImage({}, poseAt(0.2, 0.0)), level, poseAt(0.2, 0.0))
                             .changed_fraction),
            0.02);
}

/// Light of a lamp of the vehicle, with its brightest spot beside the vehicle.
double lampLight(const Eigen::Vector3d& point_m) {
  return 0.5 + 1.2 * std::exp(-(point_m.head<2>() - Eigen::Vector2d(2.2, 2.4)).squaredNorm());
}

TEST_F(GroundWatchTest, LampOfTheVehicleIsNoChangeOfTheGround) {
  light_ = lampLight;
  EXPECT_LT(meanFraction(compare({}, {})), 0.02);
}

TEST_F(GroundWatchTest, PersonIsAChangeInTheLightOfALampToo) {
  light_ = lampLight;
  const std::vector<float> changed = compare({}, personAt(2.2));
  for (const double y : {2.65, 2.8, 3.0}) {
    EXPECT_GT(fractionAt(changed, 2.2 + 0.1 * (y - 2.65), y), 0.5) << y;
  }
}

TEST_F(GroundWatchTest, MeasuredPitchIsNoChangeOfTheGround) {
  EXPECT_LT(meanFraction(compare({}, {}, 1.0 * kDegree)), 0.02);
}

TEST_F(GroundWatchTest, TexturedGroundIsKnownWithoutRanges) {
  compare({}, {});
  for (const double y : {2.0, 2.4}) {
    EXPECT_GT(fractionAt(ground_pixels_, 2.2, y), 1.0) << y;
  }
}

TEST_F(GroundWatchTest, StaticObstacleIsNoGround) {
  // Rays to the ground at these points meet the box 0.2 m and more above the ground; lower, it may pass for
  // ground.
  const BoxWorld box{{{{1.2, 1.9, 0.0}, {3.6, 2.9, 0.3}}}};
  compare(box, box);
  for (const double y : {2.2, 2.3, 2.5, 2.6}) {
    EXPECT_EQ(fractionAt(ground_pixels_, 2.2, y), 0.0) << y;
  }
}

TEST_F(GroundWatchTest, GroundIsUndecidedWithoutMotionOrTexture) {
  GroundPlane level;
  level.state = GroundState::kMeasured;
  const auto none = [](const GroundAppearance& appearance) {
    return std::all_of(appearance.ground_pixels.begin(), appearance.ground_pixels.end(),
                       [](float pixels) { return pixels == 0.0F; });
  };
  for (int i = 0; i < 3; ++i) {
    EXPECT_TRUE(none(watch_.compare(Timestamp() + durationFromSeconds(kStep_s * i),
                                    takeImage({}, poseAt(0.0, 0.0)), level, RigidTransform())));
  }
  watch_.clear();
  for (int i = 0; i < 3; ++i) {
    EXPECT_TRUE(
        none(watch_.compare(Timestamp() + durationFromSeconds(kStep_s * i),
                            cv::Mat(working_.size(), CV_8UC1, cv::Scalar(90)), level, poseAt(0.2 * i, 0.0))));
  }
}

TEST_F(GroundWatchTest, ImagesTooFarApartAreNotCompared) {
  GroundPlane level;
  level.state = GroundState::kMeasured;
  const cv::Mat image = takeImage({}, poseAt(0.0, 0.0));
  watch_.compare(Timestamp(), image, level, RigidTransform());
  EXPECT_TRUE(watch_.compare(Timestamp() + durationFromSeconds(1.5), image, level, RigidTransform())
                  .changed_fraction.empty());
  level.state = GroundState::kOutOfBounds;
  EXPECT_TRUE(watch_.compare(Timestamp() + durationFromSeconds(1.6), image, level, RigidTransform())
                  .changed_fraction.empty());
  EXPECT_THROW(watch_.compare(Timestamp() + durationFromSeconds(1.7), cv::Mat(10, 10, CV_8UC1), GroundPlane(),
                              RigidTransform()),
               std::logic_error);
}

}  // namespace
}  // namespace vcharge
