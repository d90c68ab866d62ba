#include "vcharge_localization/pose_filter.h"

#include <array>
#include <cmath>
#include <cstdio>
#include <random>

#include <gtest/gtest.h>

namespace vcharge {
namespace {

constexpr double kPeriod_s = 0.08;

/// A drive along a gentle curve: true poses, and an odometer with wrong factors.
struct Drive {
  RigidTransform map_from_vehicle;
  double counted_per_true_distance = 0.98, counted_per_true_turn = 1.01;
  double step_m = 0.2, turn_rad = 0.01;

  RigidTransform step() {
    const auto motion = [](double distance_m, double turn) {
      return RigidTransform::planar(distance_m * std::cos(0.5 * turn), distance_m * std::sin(0.5 * turn),
                                    turn);
    };
    map_from_vehicle = map_from_vehicle * motion(step_m, turn_rad);
    return motion(step_m * counted_per_true_distance, turn_rad * counted_per_true_turn);
  }
};

PoseFix fixAt(const RigidTransform& truth, double sigma_m, double sigma_rad, std::mt19937* random) {
  std::normal_distribution<double> noise(0.0, 1.0);
  Eigen::Vector3d shift, turn;
  for (double& axis : shift) {
    axis = sigma_m * noise(*random);
  }
  for (double& axis : turn) {
    axis = sigma_rad * noise(*random);
  }
  PoseFix fix;
  fix.status = LocalizationStatus::kLocalized;
  fix.map_from_vehicle =
      RigidTransform(rotationFromVector(turn) * truth.rotation(), truth.translation() + shift);
  fix.covariance.diagonal() << Eigen::Vector3d::Constant(sigma_m * sigma_m),
      Eigen::Vector3d::Constant(sigma_rad * sigma_rad);
  return fix;
}

PosePrior priorAt(const PoseFix& fix) {
  return {fix.map_from_vehicle, fix.covariance};
}

TEST(PoseFilterTest, LearnsTheOdometersFactorsAndBridgesByThem) {
  std::mt19937 random(1);
  Drive drive;
  PoseFilter filter;
  filter.reset(priorAt(fixAt(drive.map_from_vehicle, 0.01, 0.001, &random)));
  for (int i = 0; i < 600; ++i) {
    filter.predict(drive.step(), kPeriod_s);
    EXPECT_TRUE(filter.update(fixAt(drive.map_from_vehicle, 0.01, 0.001, &random)));
  }
  EXPECT_NEAR(filter.distanceScale(), 1.0 / drive.counted_per_true_distance, 0.003);
  EXPECT_NEAR(filter.turnScale(), 1.0 / drive.counted_per_true_turn, 0.005);
  const PosePrior before = filter.pose();
  for (int i = 0; i < 125; ++i) {  // 10 s, 25 m
    filter.predict(drive.step(), kPeriod_s);
  }
  const PosePrior after = filter.pose();
  const double error_m = (after.map_from_vehicle.translation() - drive.map_from_vehicle.translation()).norm();
  EXPECT_LT(error_m, 0.15) << "the raw odometer is off by half a metre";
  EXPECT_GT(after.covariance(0, 0), before.covariance(0, 0));
  EXPECT_LT(error_m, 3.0 * std::sqrt(after.covariance.topLeftCorner<3, 3>().trace()));
}

/// The error of a map's places: the same for fixes at one place, and another one some metres further.
class MapError {
 public:
  MapError(double sigma_m, double sigma_rad, uint32_t seed)
      : sigma_m_(sigma_m), sigma_rad_(sigma_rad), random_(seed) {
    for (double& value : values_) {
      value = noise_(random_);
    }
  }
  RigidTransform after(double way_m) {
    constexpr double kCorrelation_m = 4.0;
    const double kept = std::exp(-way_m / kCorrelation_m);
    for (double& value : values_) {
      value = kept * value + std::sqrt(1.0 - kept * kept) * noise_(random_);
    }
    return RigidTransform::planar(sigma_m_ * values_[0], sigma_m_ * values_[1], sigma_rad_ * values_[2]);
  }

 private:
  const double sigma_m_, sigma_rad_;
  std::mt19937 random_;
  std::normal_distribution<double> noise_{0.0, 1.0};
  std::array<double, 3> values_{};
};

RigidTransform noiseOfOdometer(const PoseFilterOptions& options, double way_m, std::mt19937* random) {
  std::normal_distribution<double> noise(0.0, std::sqrt(way_m));
  const double x_m = options.distance_sigma * noise(*random), y_m = options.distance_sigma * noise(*random);
  return RigidTransform::planar(x_m, y_m, options.yaw_sigma_rad * noise(*random));
}

/// Mean normalized error squared per degree of freedom, where fixes and a map of one drive have `factor`
/// times the errors that they are expected to have.
double consistencyOf(double factor) {
  constexpr double kSigma_m = 0.004, kSigma_rad = 0.0003;
  PoseFilterOptions options;
  options.fix_covariance_factor = 1.0;
  double sum = 0.0;
  int count = 0;
  for (uint32_t seed = 1; seed <= 60; ++seed) {
    std::mt19937 random(seed);
    Drive drive;
    PoseFilter filter(options);
    filter.reset(priorAt(fixAt(drive.map_from_vehicle, 0.02, 0.001, &random)));
    MapError map_error(factor * kSigma_m, factor * kSigma_rad, seed);
    for (int i = 0; i < 500; ++i) {
      const RigidTransform moved = drive.step();
      const double way_m = moved.translation().norm();
      filter.predict(moved * noiseOfOdometer(options, way_m, &random), kPeriod_s);
      const RigidTransform shifted = map_error.after(way_m);
      const RigidTransform seen(shifted.rotation() * drive.map_from_vehicle.rotation(),
                                drive.map_from_vehicle.translation() + shifted.translation());
      PoseFix fix = fixAt(seen, factor * kSigma_m, factor * kSigma_rad, &random);
      fix.covariance /= factor * factor;
      filter.update(fix);
      if (i > 100 && i % 50 == 24) {
        const PosePrior pose = filter.pose();
        const Eigen::Vector3d shift =
            pose.map_from_vehicle.translation() - drive.map_from_vehicle.translation();
        const Eigen::Vector3d turn = vectorFromRotation(pose.map_from_vehicle.rotation() *
                                                        drive.map_from_vehicle.rotation().conjugate());
        const Eigen::Vector3d error(shift.x(), shift.y(), turn.z());
        Eigen::Matrix3d covariance;
        const int planar[] = {0, 1, 5};
        for (int row = 0; row < 3; ++row) {
          for (int column = 0; column < 3; ++column) {
            covariance(row, column) = pose.covariance(planar[row], planar[column]);
          }
        }
        sum += error.dot(covariance.inverse() * error) / 3.0;
        ++count;
      }
    }
  }
  return sum / count;
}

TEST(PoseFilterTest, ErrorAgreesWithTheCovariance) {
  for (const double factor : {0.3, 1.0, 2.0}) {
    const double consistency = consistencyOf(factor);
    std::printf("normalized error squared with errors of %g times the expected ones: %.2f\n", factor,
                consistency);
    EXPECT_GT(consistency, 0.3) << factor;
    EXPECT_LT(consistency, factor == 1.0 ? 2.0 : 2.5) << factor;
  }
}

TEST(PoseFilterTest, RefusesAFixThatContradicts) {
  std::mt19937 random(2);
  Drive drive;
  PoseFilter filter;
  filter.reset(priorAt(fixAt(drive.map_from_vehicle, 0.01, 0.001, &random)));
  for (int i = 0; i < 50; ++i) {
    filter.predict(drive.step(), kPeriod_s);
    filter.update(fixAt(drive.map_from_vehicle, 0.01, 0.001, &random));
  }
  const PosePrior before = filter.pose();
  const RigidTransform wrong = drive.map_from_vehicle * RigidTransform::planar(1.5, 0.5, 0.0);
  EXPECT_FALSE(filter.update(fixAt(wrong, 0.01, 0.001, &random)));
  EXPECT_EQ(filter.pose().map_from_vehicle.matrix(), before.map_from_vehicle.matrix());
  EXPECT_EQ(filter.pose().covariance, before.covariance);
}

TEST(PoseFilterTest, KnowsNothingBeforeTheFirstPoseAndAfterForgetting) {
  PoseFilter filter;
  EXPECT_FALSE(filter.hasPose());
  EXPECT_THROW(filter.pose(), std::logic_error);
  filter.predict(RigidTransform::planar(1.0, 0.0, 0.0), 1.0);
  EXPECT_FALSE(filter.hasPose());
  filter.reset(PosePrior());
  EXPECT_TRUE(filter.hasPose());
  filter.forget();
  EXPECT_FALSE(filter.hasPose());
}

TEST(PoseFilterTest, CovarianceStaysSymmetricAndPositive) {
  std::mt19937 random(3);
  Drive drive;
  PoseFilter filter;
  filter.reset(priorAt(fixAt(drive.map_from_vehicle, 0.01, 0.001, &random)));
  for (int i = 0; i < 2000; ++i) {
    filter.predict(drive.step(), kPeriod_s);
    if (i % 3 == 0) {
      filter.update(fixAt(drive.map_from_vehicle, 1e-4, 1e-5, &random));
    }
  }
  const Eigen::Matrix<double, 6, 6> covariance = filter.pose().covariance;
  EXPECT_LT((covariance - covariance.transpose()).norm(), 1e-12);
  EXPECT_EQ(covariance.llt().info(), Eigen::Success);
}

TEST(PoseFilterTest, AMapHasTheErrorOfAFixOverTheNumberOfDrives) {
  constexpr double kSigma_m = 0.01;
  PoseFix fix;
  fix.covariance = kSigma_m * kSigma_m * Eigen::Matrix<double, 6, 6>::Identity();
  for (const double num_drives : {1.0, 2.0, 4.0}) {
    fix.map_variance_ratio = 1.0 / num_drives;
    PoseFilter filter;
    filter.reset(fix);
    for (int i = 0; i < 100000; ++i) {
      ASSERT_TRUE(filter.update(fix));
    }
    EXPECT_NEAR(filter.prediction().covariance(0, 0), kSigma_m * kSigma_m / num_drives,
                1e-3 * kSigma_m * kSigma_m);
  }
}

TEST(PoseFilterTest, APriorHasNoErrorOfTheMapBeforeTheFirstFix) {
  PosePrior prior;
  prior.covariance = Eigen::Matrix<double, 6, 6>::Identity();
  PoseFilter filter;
  filter.reset(PoseFix());
  filter.reset(prior);
  EXPECT_EQ(filter.pose().covariance, prior.covariance);
}

}  // namespace
}  // namespace vcharge
