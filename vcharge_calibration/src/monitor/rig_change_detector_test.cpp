// Changes of a car, on drawn deviations.
#include "vcharge_calibration/monitor/rig_change_detector.h"

#include <cmath>
#include <memory>
#include <random>

#include <gtest/gtest.h>

#include "vcharge_reconstruction/testing/test_camera.h"

namespace vcharge {
namespace {

constexpr double kDegree = 0.017453292519943295;
constexpr double kPart_m = 10.0;
constexpr double kFalseAlarmsPerKm = 1e-3;
// Deviations of what a part of a drive says.
constexpr double kShift_m = 0.02;
constexpr double kTurn_rad = 0.0008;

CameraRig makeRig() {
  CameraRig rig;
  rig.cameras = {
      testing::makeFisheyeCamera("front", 200.0, testing::makeExtrinsics(0.0, 0.3, 0.0, {3.6, 0.0, 0.6})),
      testing::makeFisheyeCamera("left", 200.0, testing::makeExtrinsics(1.6, 0.3, 0.0, {1.9, 0.9, 0.9})),
      testing::makeFisheyeCamera("rear", 200.0, testing::makeExtrinsics(3.1, 0.3, 0.0, {-0.8, 0.0, 0.8}))};
  return rig;
}

/// Draws the deviations of the parts of a drive.
class DrawnDrive {
 public:
  explicit DrawnDrive(uint32_t seed) : random_(seed), truth_(Eigen::VectorXd::Zero(RigDeviation::rowOf(3))) {
    sigmas_.resize(truth_.size());
    sigmas_.head<3>() << 0.006, 0.01, 0.0004;
    for (size_t i = 0; i < 3; ++i) {
      sigmas_.segment<6>(RigDeviation::rowOf(i)) << Eigen::Vector3d::Constant(kShift_m),
          Eigen::Vector3d::Constant(kTurn_rad);
    }
  }

  /// What the car deviates by from now on.
  Eigen::VectorXd& truth() { return truth_; }
  double travelled_m() const { return travelled_m_; }

  RigDeviation next() {
    RigDeviation deviation;
    deviation.begin_m = travelled_m_;
    deviation.end_m = travelled_m_ += kPart_m;
    deviation.num_observations.assign(3, 1000);
    deviation.information = sigmas_.cwiseAbs2().cwiseInverse().asDiagonal();
    Eigen::VectorXd found = truth_;
    for (Eigen::Index i = 0; i < found.size(); ++i) {
      found[i] += sigmas_[i] * noise_(random_);
    }
    const double roll_rad = 0.002 * noise_(random_), pitch_rad = 0.002 * noise_(random_);
    for (size_t i = 0; i < 3; ++i) {
      found[RigDeviation::rowOf(i) + 3] += roll_rad;
      found[RigDeviation::rowOf(i) + 4] += pitch_rad;
    }
    deviation.information_vector = deviation.information * found;
    return deviation;
  }

 private:
  std::mt19937 random_;
  std::normal_distribution<double> noise_{0.0, 1.0};
  Eigen::VectorXd truth_, sigmas_;
  double travelled_m_ = 0.0;
};

/// Drives until a change is found, at most this far.
std::optional<RigChange> driveUntilChange(double length_m, DrawnDrive* drive, RigChangeDetector* detector) {
  const double end_m = drive->travelled_m() + length_m;
  while (drive->travelled_m() < end_m) {
    if (auto change = detector->add(drive->next())) {
      return change;
    }
  }
  return std::nullopt;
}

TEST(RigChangeDetectorTest, RaisesNoAlarmWithoutAChange) {
  for (uint32_t seed = 1; seed <= 5; ++seed) {
    DrawnDrive drive(seed);
    RigChangeDetector detector(makeRig(), kFalseAlarmsPerKm);
    EXPECT_FALSE(driveUntilChange(3000.0, &drive, &detector)) << "seed " << seed;
    const Eigen::VectorXd normalized =
        detector.deviation().cwiseAbs().cwiseQuotient(detector.covariance().diagonal().cwiseSqrt());
    EXPECT_LT(normalized.maxCoeff(), 4.0);
  }
}

TEST(RigChangeDetectorTest, NamesTheCameraAndItsAxis) {
  for (size_t camera = 0; camera < 3; ++camera) {
    for (Eigen::Index axis = 0; axis < 6; ++axis) {
      DrawnDrive drive(static_cast<uint32_t>(10 * camera) + static_cast<uint32_t>(axis));
      RigChangeDetector detector(makeRig(), kFalseAlarmsPerKm);
      ASSERT_FALSE(driveUntilChange(200.0, &drive, &detector));
      const double size = axis < 3 ? 0.06 : 0.2 * kDegree;
      drive.truth()[RigDeviation::rowOf(camera) + axis] = size;
      const std::optional<RigChange> change = driveUntilChange(300.0, &drive, &detector);
      ASSERT_TRUE(change) << "camera " << camera << ", axis " << axis;
      EXPECT_EQ(change->part, RigPart::kCamera);
      EXPECT_EQ(change->camera, camera);
      EXPECT_EQ(change->mainAxis(), axis);
      EXPECT_FALSE(change->is_slow);
      EXPECT_LE(change->earliest_m, 200.0);
      EXPECT_LE(change->latest_m, 250.0);
      EXPECT_LE(change->found_m, 400.0);
      EXPECT_NEAR(change->size[axis], size, 4.0 * std::sqrt(change->covariance(axis, axis)));
      // The deviation becomes more certain, and is not found again.
      EXPECT_FALSE(driveUntilChange(500.0, &drive, &detector));
      const Eigen::VectorXd error = detector.deviation() - drive.truth();
      const Eigen::VectorXd sigmas = detector.covariance().diagonal().cwiseSqrt();
      EXPECT_LT(error.cwiseAbs().cwiseQuotient(sigmas).maxCoeff(), 4.5);
    }
  }
}

TEST(RigChangeDetectorTest, TellsASlowChangeFromAKnock) {
  DrawnDrive drive(9);
  RigChangeDetector detector(makeRig(), kFalseAlarmsPerKm);
  ASSERT_FALSE(driveUntilChange(300.0, &drive, &detector));
  const Eigen::Index row = RigDeviation::rowOf(2) + 4;
  std::vector<RigChange> changes;
  for (int i = 0; i < 100; ++i) {
    drive.truth()[row] += 0.005 * kDegree;  // in the heat, over each 10 m
    if (const auto change = detector.add(drive.next())) {
      EXPECT_EQ(change->camera, 2U);
      EXPECT_EQ(change->mainAxis(), 4);
      EXPECT_EQ(change->is_slow, !changes.empty());
      changes.push_back(*change);
    }
  }
  EXPECT_GT(changes.size(), 1U);
  EXPECT_NEAR(detector.deviation()[row], drive.truth()[row], 0.2 * kDegree);
}

TEST(RigChangeDetectorTest, FindsLargeChangesWithin30Metres) {
  DrawnDrive drive(3);
  RigChangeDetector detector(makeRig(), kFalseAlarmsPerKm);
  ASSERT_FALSE(driveUntilChange(100.0, &drive, &detector));
  drive.truth()[RigDeviation::rowOf(1) + 5] = 0.5 * kDegree;
  EXPECT_TRUE(driveUntilChange(30.0, &drive, &detector));
}

TEST(RigChangeDetectorTest, TellsATyreFromACamera) {
  DrawnDrive drive(4);
  RigChangeDetector detector(makeRig(), kFalseAlarmsPerKm);
  ASSERT_FALSE(driveUntilChange(200.0, &drive, &detector));
  drive.truth()[0] = -0.0015;
  drive.truth()[2] = 0.002;  // one wheel is smaller by 0.3 %
  const std::optional<RigChange> change = driveUntilChange(200.0, &drive, &detector);
  ASSERT_TRUE(change);
  EXPECT_EQ(change->part, RigPart::kOdometer);
  EXPECT_EQ(change->mainAxis(), 2);
}

TEST(RigChangeDetectorTest, TellsALoadFromCameras) {
  DrawnDrive drive(5);
  RigChangeDetector detector(makeRig(), kFalseAlarmsPerKm);
  ASSERT_FALSE(driveUntilChange(200.0, &drive, &detector));
  const CameraRig rig = makeRig();
  const Eigen::Vector3d turn_rad(0.0, -0.8 * kDegree, 0.0);
  for (size_t i = 0; i < 3; ++i) {
    drive.truth().segment<6>(RigDeviation::rowOf(i))
        << turn_rad.cross(rig.cameras[i].vehicle_from_camera->translation()),
        turn_rad;
  }
  const std::optional<RigChange> change = driveUntilChange(200.0, &drive, &detector);
  ASSERT_TRUE(change);
  EXPECT_EQ(change->part, RigPart::kBody);
  EXPECT_EQ(change->mainAxis(), 2);
  EXPECT_NEAR(change->size[2], turn_rad.y(), 0.004);
}

TEST(RigChangeDetectorTest, ASinglePartIsNoChange) {
  DrawnDrive drive(6);
  RigChangeDetector detector(makeRig(), kFalseAlarmsPerKm);
  ASSERT_FALSE(driveUntilChange(200.0, &drive, &detector));
  drive.truth()[RigDeviation::rowOf(2) + 4] = 2.0 * kDegree;  // as if a bus had passed
  EXPECT_FALSE(driveUntilChange(kPart_m, &drive, &detector));
  drive.truth().setZero();
  EXPECT_FALSE(driveUntilChange(1000.0, &drive, &detector));
}

TEST(RigChangeDetectorTest, FindsASecondKnock) {
  DrawnDrive drive(7);
  RigChangeDetector detector(makeRig(), kFalseAlarmsPerKm);
  ASSERT_FALSE(driveUntilChange(200.0, &drive, &detector));
  drive.truth()[RigDeviation::rowOf(0) + 4] = 0.3 * kDegree;
  ASSERT_TRUE(driveUntilChange(100.0, &drive, &detector));
  ASSERT_FALSE(driveUntilChange(100.0, &drive, &detector));
  drive.truth()[RigDeviation::rowOf(0) + 4] = 0.0;
  const std::optional<RigChange> change = driveUntilChange(200.0, &drive, &detector);
  ASSERT_TRUE(change);
  EXPECT_EQ(change->camera, 0U);
  EXPECT_FALSE(change->is_slow);
  EXPECT_NEAR(change->size[4], -0.3 * kDegree, 0.002);
}

TEST(RigChangeDetectorTest, CountsFromARepairedRigWithoutForgetting) {
  DrawnDrive drive(4);
  RigChangeDetector detector(makeRig(), kFalseAlarmsPerKm);
  ASSERT_FALSE(driveUntilChange(200.0, &drive, &detector));
  drive.truth()[RigDeviation::rowOf(1) + 4] = 0.3 * kDegree;
  ASSERT_TRUE(driveUntilChange(200.0, &drive, &detector));
  driveUntilChange(100.0, &drive, &detector);
  Eigen::VectorXd repair = Eigen::VectorXd::Zero(RigDeviation::rowOf(3));
  repair.segment<6>(RigDeviation::rowOf(1)) = detector.deviation().segment<6>(RigDeviation::rowOf(1));
  const Eigen::VectorXd before = detector.deviation();
  const Eigen::MatrixXd covariance = detector.covariance();
  detector.countFrom(repair);
  EXPECT_TRUE(detector.deviation().isApprox(before - repair, 1e-9));
  EXPECT_TRUE(detector.covariance().isApprox(covariance, 1e-12));
  // The drive goes on with a rig that was repaired; what is left is no change.
  drive.truth() -= repair;
  EXPECT_FALSE(driveUntilChange(500.0, &drive, &detector));
}

TEST(RigChangeDetectorTest, ComparesWithTheCovarianceOfTheRig) {
  // The car was parked and knocked: the rig is wrong from the beginning.
  for (const bool is_certain : {false, true}) {
    CameraRig rig = makeRig();
    Eigen::Matrix<double, 6, 6> covariance = Eigen::Matrix<double, 6, 6>::Zero();
    const double sigma_rad = is_certain ? 0.01 * kDegree : 1.0 * kDegree;
    covariance.diagonal() << Eigen::Vector3d::Constant(1e-6),
        Eigen::Vector3d::Constant(sigma_rad * sigma_rad);
    for (RigCamera& camera : rig.cameras) {
      camera.covariance = covariance;
    }
    DrawnDrive drive(8);
    RigChangeDetector detector(rig, kFalseAlarmsPerKm);
    drive.truth()[RigDeviation::rowOf(1) + 3] = 0.3 * kDegree;
    const std::optional<RigChange> change = driveUntilChange(200.0, &drive, &detector);
    EXPECT_EQ(change.has_value(), is_certain);
    if (change) {
      EXPECT_EQ(change->camera, 1U);
      EXPECT_EQ(change->earliest_m, 0.0);
    }
  }
}

}  // namespace
}  // namespace vcharge
