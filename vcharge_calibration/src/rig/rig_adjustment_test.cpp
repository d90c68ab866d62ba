// Joint adjustment on analytic tracks: a known car, fisheye cameras that do not overlap, points on the ground
// and above it, a drive of circles to both sides.
#include "rig/rig_adjustment.h"

#include <cmath>
#include <memory>

#include <gtest/gtest.h>
#include <tbb/global_control.h>

#include "rig/ground.h"
#include "testing/analytic_drive.h"
#include "vcharge_calibration/rig/rig_calibrator_options.h"

namespace vcharge {
namespace {

using testing::kNoise_px;

constexpr double kDegree = 0.017453292519943295;
using Vector6d = Eigen::Matrix<double, 6, 1>;

RigAdjustmentOptions makeOptions() {
  RigAdjustmentOptions options = RigCalibratorOptions::defaultAdjustment();
  options.bundle.odometry_sigma_m = 0.002;
  options.bundle.odometry_distance_sigma = 0.0;
  options.bundle.odometry_sigma_rad = 0.0005;
  options.bundle.odometry_turn_sigma = 0.0;
  options.bundle.cost_tolerance = 1e-5;
  options.bundle.max_iterations = 60;
  return options;
}

/// Rotates and shifts the cameras like an inaccurate initial rig.
void disturbRig(ReconstructionData* data) {
  auto rig = std::make_shared<CameraRig>(*data->rig);
  for (size_t i = 0; i < rig->cameras.size(); ++i) {
    const double sign = i == 0 ? 1.0 : -1.0;
    const RigidTransform& extrinsics = *rig->cameras[i].vehicle_from_camera;
    rig->cameras[i].vehicle_from_camera = RigidTransform(
        rotationFromVector(sign * Eigen::Vector3d(0.008, -0.006, 0.01)) * extrinsics.rotation(),
        extrinsics.translation() + sign * Eigen::Vector3d(0.05, -0.04, 0.03));
  }
  data->rig = rig;
}

Vector6d errorOf(const CameraRig& rig, const CameraRig& truth, size_t camera) {
  const RigidTransform& found = *rig.cameras[camera].vehicle_from_camera;
  const RigidTransform& extrinsics = *truth.cameras[camera].vehicle_from_camera;
  Vector6d error;
  error << found.translation() - extrinsics.translation(),
      vectorFromRotation(found.rotation() * extrinsics.rotation().conjugate());
  return error;
}

TEST(RigAdjustmentTest, FindsTheCamerasOfAKnownDrive) {
  ReconstructionData data = testing::makeAnalyticDrive(1, kNoise_px);
  const std::shared_ptr<const CameraRig> truth = data.rig;
  disturbRig(&data);
  const RigAdjustmentOptions options = makeOptions();
  RigAdjustmentOptions lenient = options;
  lenient.bundle.outlier_sigmas = INFINITY;
  adjustRig(lenient, RigPriors(), &data);
  adjustRig(options, RigPriors(), &data);
  for (size_t i = 0; i < 2; ++i) {
    const Vector6d error = errorOf(*data.rig, *truth, i);
    EXPECT_LT(error.head<3>().cwiseAbs().maxCoeff(), 0.01) << error.transpose();
    EXPECT_LT(error.tail<3>().norm(), 0.05 * kDegree) << error.transpose();
  }
}

TEST(RigAdjustmentTest, CovarianceMatchesTheErrors) {
  // Squared errors divided by their variances: the mean over many drives is near 1.
  Vector6d sum = Vector6d::Zero();
  constexpr int kDrives = 5;
  for (uint32_t seed = 1; seed <= kDrives; ++seed) {
    ReconstructionData data = testing::makeAnalyticDrive(seed, kNoise_px);
    const std::shared_ptr<const CameraRig> truth = data.rig;
    const RigAdjustmentOptions options = makeOptions();
    adjustRig(options, RigPriors(), &data);
    const RigUncertainty uncertainty = rigUncertainty(options, RigPriors(), data);
    ASSERT_TRUE(uncertainty.is_valid);
    for (Eigen::Index i = 0; i < 2; ++i) {
      const Vector6d error = errorOf(*data.rig, *truth, static_cast<size_t>(i));
      sum += error.cwiseAbs2().cwiseQuotient(
          uncertainty.covariance.block<6, 6>(6 * i, 6 * i)
              .diagonal()
              .cwiseMax(uncertainty.jackknife.block<6, 6>(6 * i, 6 * i).diagonal()));
    }
  }
  const Vector6d mean = sum / (2.0 * kDrives);
  for (int i = 0; i < 6; ++i) {
    // Ten errors that correlate in pairs: chi-square of five degrees of freedom over five, within these
    // bounds in 99 % of all cases. Height and tilt may err less: the ground is smoother than assumed.
    EXPECT_LT(mean[i], 3.3) << i << ": " << mean.transpose();
    if (i == 0 || i == 1 || i == 5) {
      EXPECT_GT(mean[i], 0.08) << i << ": " << mean.transpose();
    }
  }
}

/// Replaces the cameras' models by ones whose images deviate by the given amount.
void disturbIntrinsics(const ImageDeviation& deviation, ReconstructionData* data) {
  auto rig = std::make_shared<CameraRig>(*data->rig);
  for (RigCamera& camera : rig->cameras) {
    camera.model = camera.model.withImage(std::exp(-deviation[0]), -deviation.tail<2>());
  }
  data->rig = rig;
}

TEST(RigAdjustmentTest, CorrectsIntrinsicsThatHeatHasChanged) {
  const ImageDeviation truth(0.002, 1.0, -0.7);
  ReconstructionData data = testing::makeAnalyticDrive(1, kNoise_px);
  const std::shared_ptr<const CameraRig> true_rig = data.rig;
  disturbIntrinsics(truth, &data);
  ReconstructionData kept = data;
  RigPriors priors;
  addKnownCameras(*data.rig, &priors);
  RigAdjustmentOptions options = makeOptions();
  options.bundle.outlier_sigmas = INFINITY;
  adjustRig(options, priors, &kept);
  options.refine_intrinsics = true;
  adjustRig(options, priors, &data);
  const RigUncertainty uncertainty = rigUncertainty(options, priors, data);
  ASSERT_TRUE(uncertainty.is_valid);
  EXPECT_EQ(uncertainty.covariance.rows(), 12);
  for (size_t i = 0; i < 2; ++i) {
    const ImageDeviation found = imageDeviation(data.rig->cameras[i].model, priors.models[i]);
    const auto at = static_cast<Eigen::Index>(3 * i);
    const Eigen::Vector3d sigmas = uncertainty.image_covariance.diagonal().segment<3>(at).cwiseSqrt();
    EXPECT_LT((found - truth).cwiseQuotient(sigmas).cwiseAbs().maxCoeff(), 4.0) << found.transpose();
    EXPECT_LT(sigmas[0], 0.0005);
    EXPECT_LT(errorOf(*data.rig, *true_rig, i).tail<3>().norm(),
              0.5 * errorOf(*kept.rig, *true_rig, i).tail<3>().norm())
        << "extrinsics make up for wrong intrinsics";
  }
}

TEST(RigAdjustmentTest, TellsHowImagesDeviateWithoutCorrectingThem) {
  for (const double sign : {0.0, 1.0, -1.0}) {
    const ImageDeviation truth = sign * ImageDeviation(0.002, 1.0, -0.7);
    ReconstructionData data = testing::makeAnalyticDrive(1, kNoise_px);
    disturbIntrinsics(truth, &data);
    const std::shared_ptr<const CameraRig> given = data.rig;
    RigPriors priors;
    addKnownCameras(*data.rig, &priors);
    RigAdjustmentOptions options = makeOptions();
    options.bundle.outlier_sigmas = INFINITY;
    adjustRig(options, priors, &data);
    EXPECT_EQ(data.rig->cameras[0].model.parameters(), given->cameras[0].model.parameters());
    const RigUncertainty uncertainty = rigUncertainty(options, priors, data);
    ASSERT_TRUE(uncertainty.is_valid);
    for (Eigen::Index i = 0; i < 2; ++i) {
      EXPECT_NEAR(uncertainty.image_deviations[3 * i], truth[0], 0.0006) << sign;
    }
  }
}

/// A drive with rolling shutters, of which its rig says nothing.
ReconstructionData makeDriveOfUnknownTiming(const ImageTiming& truth) {
  ReconstructionData data = testing::makeAnalyticDrive(1, kNoise_px, 0.0, truth);
  auto rig = std::make_shared<CameraRig>(*data.rig);
  for (RigCamera& camera : rig->cameras) {
    camera.timing = ImageTiming();
  }
  data.rig = rig;
  return data;
}

TEST(RigAdjustmentTest, FindsReadoutTimesAndClockOffsets) {
  const ImageTiming truth{0.02, ReadoutDirection::kDown, 0.0};
  ReconstructionData data = makeDriveOfUnknownTiming(truth);
  const std::shared_ptr<const CameraRig> true_rig = data.rig;
  RigPriors priors;
  addKnownCameras(*data.rig, &priors);
  RigAdjustmentOptions options = makeOptions();
  options.bundle.outlier_sigmas = INFINITY;
  options.refine_timing = true;
  options.bundle.cost_tolerance = 1e-6;  // it begins far away
  adjustRig(options, priors, &data);
  const TimingUncertainty uncertainty = timingUncertainty(options, priors, data);
  ASSERT_EQ(uncertainty.deviations.size(), 4);
  for (size_t i = 0; i < 2; ++i) {
    const ImageTiming& found = data.rig->cameras[i].timing;
    const auto at = static_cast<Eigen::Index>(2 * i);
    const Eigen::Vector2d sigmas_s = uncertainty.covariance.diagonal().segment<2>(at).cwiseSqrt();
    EXPECT_LT(std::abs(found.readout_s - truth.readout_s), 4.0 * sigmas_s[0]) << found.readout_s;
    EXPECT_LT(std::abs(found.clock_offset_s - truth.clock_offset_s), 4.0 * sigmas_s[1])
        << found.clock_offset_s;
    EXPECT_LT(sigmas_s.maxCoeff(), 0.001);
    const Vector6d error = errorOf(*data.rig, *true_rig, i);
    EXPECT_LT(error.head<3>().cwiseAbs().maxCoeff(), 0.01) << error.transpose();
    EXPECT_LT(std::abs(error[5]) / kDegree, 0.05) << error.transpose();
    EXPECT_LT(error.tail<3>().norm() / kDegree, 0.1) << "the ground is rough: " << error.transpose();
  }
}

TEST(RigAdjustmentTest, TellsTheTimingWithoutCorrectingIt) {
  const ImageTiming truth{0.01, ReadoutDirection::kDown, 0.0};
  ReconstructionData data = makeDriveOfUnknownTiming(truth);
  RigPriors priors;
  addKnownCameras(*data.rig, &priors);
  RigAdjustmentOptions options = makeOptions();
  options.bundle.outlier_sigmas = INFINITY;
  adjustRig(options, priors, &data);
  EXPECT_TRUE(data.rig->cameras[0].timing.isInstant());
  const TimingUncertainty uncertainty = timingUncertainty(options, priors, data);
  ASSERT_EQ(uncertainty.deviations.size(), 4);
  EXPECT_NEAR(uncertainty.deviations[0], truth.readout_s, 0.003);
  EXPECT_NEAR(uncertainty.deviations[2], truth.readout_s, 0.003);
}

TEST(RigAdjustmentTest, StatedDeviationsOfIntrinsicsMakeExtrinsicsUncertain) {
  ReconstructionData data = testing::makeAnalyticDrive(1, kNoise_px);
  const RigAdjustmentOptions options = makeOptions();
  adjustRig(options, RigPriors(), &data);
  const Eigen::MatrixXd certain = rigUncertainty(options, RigPriors(), data).covariance;
  RigPriors priors;
  addKnownCameras(*data.rig, &priors);
  const RigUncertainty not_stated = rigUncertainty(options, priors, data);
  EXPECT_LT((not_stated.covariance - certain).norm(), 1e-3 * certain.norm());
  EXPECT_EQ(not_stated.by_intrinsics.norm(), 0.0);
  for (ImageDeviation& sigmas : priors.stated_image_sigmas) {
    sigmas = ImageDeviation(0.001, 0.5, 0.5);
  }
  const Eigen::MatrixXd stated = rigUncertainty(options, priors, data).by_intrinsics;
  EXPECT_GT(stated(5, 5), certain(5, 5)) << "a shift of the image is nearly a yaw";
}

TEST(RigAdjustmentTest, JackknifeLeavesOutABodyThatLeansToBothSides) {
  const auto rollVariance = [](double lean_rad) {
    ReconstructionData data = testing::makeAnalyticDrive(1, kNoise_px, lean_rad);
    adjustRig(makeOptions(), RigPriors(), &data);
    const RigUncertainty uncertainty = rigUncertainty(makeOptions(), RigPriors(), data);
    EXPECT_TRUE(uncertainty.is_valid);
    return uncertainty.jackknife(3, 3);
  };
  EXPECT_LT(rollVariance(0.1 * kDegree), 2.0 * rollVariance(0.0));
}

TEST(RigAdjustmentTest, GivesTheSameBitsOnOneThread) {
  ReconstructionData parallel = testing::makeAnalyticDrive(2, kNoise_px);
  disturbRig(&parallel);
  ReconstructionData serial = parallel;
  RigAdjustmentOptions options = makeOptions();
  options.bundle.max_iterations = 3;
  adjustRig(options, RigPriors(), &parallel);
  const tbb::global_control one_thread(tbb::global_control::max_allowed_parallelism, 1);
  adjustRig(options, RigPriors(), &serial);
  for (size_t i = 0; i < 2; ++i) {
    EXPECT_EQ(parallel.rig->cameras[i].vehicle_from_camera->translation(),
              serial.rig->cameras[i].vehicle_from_camera->translation());
  }
}

TEST(GroundTest, FindsTheHeightOfACameraPutAtZero) {
  ReconstructionData data = testing::makeAnalyticDrive(4, 0.0);
  auto rig = std::make_shared<CameraRig>(*data.rig);
  const RigidTransform& extrinsics = *rig->cameras[1].vehicle_from_camera;
  rig->cameras[1].vehicle_from_camera =
      RigidTransform(extrinsics.rotation(),
                     Eigen::Vector3d(extrinsics.translation().x(), extrinsics.translation().y(), 0.0));
  data.rig = rig;
  for (Track& track : data.tracks) {
    if (track.position_m) {
      track.position_m->z() -= 0.9;
    }
  }
  const std::optional<double> height_m = findCameraHeight(data, 1);
  ASSERT_TRUE(height_m.has_value());
  EXPECT_NEAR(*height_m, 0.9, 0.01);
}

TEST(GroundTest, UsesOnlyPointsUnderThePath) {
  const ReconstructionData data = testing::makeAnalyticDrive(5, 0.0);
  const std::vector<GroundPoint> ground = findGroundPoints(data, 0.15);
  EXPECT_GT(ground.size(), 100U);
  for (const GroundPoint& point : ground) {
    EXPECT_LT(std::abs(data.tracks[point.track].position_m->z()), 0.15);
  }
}

TEST(GroundTest, LeavesPointsOfImpreciseHeightOut) {
  ReconstructionData data = testing::makeAnalyticDrive(5, 0.0);
  const size_t num_all = findGroundPoints(data, 0.15).size();
  for (size_t t = 0; t < data.tracks.size(); ++t) {
    const double sigma_m = t % 3 == 0 ? 0.002 : 0.02;
    data.tracks[t].covariance_m2 = sigma_m * sigma_m * Eigen::Matrix3d::Identity();
  }
  EXPECT_EQ(findGroundPoints(data, 0.15).size(), num_all);
  const std::vector<GroundPoint> precise = findPreciseGround(data, 0.15);
  EXPECT_NEAR(static_cast<double>(precise.size()), static_cast<double>(num_all) / 3.0,
              0.1 * static_cast<double>(num_all));
  for (const GroundPoint& point : precise) {
    EXPECT_EQ(point.track % 3, 0);
  }
}

TEST(GroundTest, AllOfItTellsMoreThanThePreciseOnes) {
  ReconstructionData data = testing::makeAnalyticDrive(5, testing::kNoise_px);
  for (size_t t = 0; t < data.tracks.size(); ++t) {
    const double sigma_m = t % 3 == 0 ? 0.002 : 0.02;
    data.tracks[t].covariance_m2 = sigma_m * sigma_m * Eigen::Matrix3d::Identity();
  }
  RigPriors priors;
  const RigUncertainty precise = rigUncertainty(RigCalibratorOptions::defaultAdjustment(), priors, data);
  priors.uses_all_ground = true;
  const RigUncertainty all = rigUncertainty(RigCalibratorOptions::defaultAdjustment(), priors, data);
  ASSERT_TRUE(precise.is_valid && all.is_valid);
  for (const Eigen::Index height : {2, 8}) {
    EXPECT_LT(all.covariance(height, height), 0.6 * precise.covariance(height, height));
  }
}

TEST(GroundTest, BiasFollowsTheDeviationOfHeights) {
  ReconstructionData data = testing::makeAnalyticDrive(5, 0.0);
  const GroundBias unknown = findGroundBias(data, findPreciseGround(data, 0.15));
  EXPECT_EQ(unknown.height_m, 0.0) << "nothing was adjusted";
  GroundBias bias[2];
  for (const int i : {0, 1}) {
    const double sigma_m = i == 0 ? 0.001 : 0.002;
    for (Track& track : data.tracks) {
      track.covariance_m2 = sigma_m * sigma_m * Eigen::Matrix3d::Identity();
    }
    bias[i] = findGroundBias(data, findPreciseGround(data, 0.15));
    EXPECT_LT(bias[i].height_m, 0.5 * sigma_m) << "many landmarks are more precise than one";
    EXPECT_GT(bias[i].height_m, 0.1 * sigma_m) << "neighbours err alike";
    // Ground is seen within five metres.
    EXPECT_GT(bias[i].pitch_rad, bias[i].height_m / 5.0);
    EXPECT_GT(bias[i].roll_rad, bias[i].height_m / 5.0);
  }
  EXPECT_NEAR(bias[1].pitch_rad, 2.0 * bias[0].pitch_rad, 1e-9);
  EXPECT_EQ(findGroundBias(data, {}).pitch_rad, 0.0);
}

}  // namespace
}  // namespace vcharge
