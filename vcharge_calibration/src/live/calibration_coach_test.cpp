#include "vcharge_calibration/live/calibration_coach.h"

#include <cmath>
#include <random>
#include <string>
#include <utility>
#include <vector>

#include <gtest/gtest.h>

namespace vcharge {
namespace {

constexpr double kDegree = 0.017453292519943295;
constexpr double kStep_m = 0.5;

RigidTransform trueExtrinsics() {
  return RigidTransform(rotationFromYawPitchRoll(1.4, 0.3, -1.9), Eigen::Vector3d(1.9, 0.95, 0.0));
}

/// A piece of the drive: its length in metres, and its turn (to the left).
struct Piece {
  double length_m = 0.0, turn_rad = 0.0;
};

/// Drives along pieces and feeds a coach with the noisy motions of one camera.
class CoachedDrive {
 public:
  explicit CoachedDrive(uint32_t seed = 1, double noise_rad = 0.003)
      : random_(seed), noise_rad_(noise_rad), coach_({"left"}, HandEyeOptions(), CalibrationCoachOptions()) {
    coach_.addKeyframe(vehicle_, 0.0);
  }

  void drive(const std::vector<Piece>& pieces) {
    for (const Piece& piece : pieces) {
      const int steps = static_cast<int>(std::lround(piece.length_m / kStep_m));
      for (int i = 0; i < steps; ++i) {
        // The curvature varies: circles of one radius do not determine the position.
        const double weight = 1.0 - std::cos(2.0 * M_PI * (i + 0.5) / steps);
        step(weight * piece.turn_rad / steps);
      }
    }
  }

  bool sees = true;
  /// Standard deviation of an error of the camera's directions that is constant over some metres.
  double common_error_rad = 0.0;
  /// Factor on the odometer's turns; -1: it counts with the wrong sign.
  double odometer_sign = 1.0;

  DriveOutlook outlook() const { return coach_.outlook(); }
  const CalibrationCoach& coach() const { return coach_; }

 private:
  void step(double turn_rad) {
    const RigidTransform motion = RigidTransform::planar(kStep_m * std::cos(0.5 * turn_rad),
                                                         kStep_m * std::sin(0.5 * turn_rad), turn_rad);
    vehicle_ = vehicle_ * motion;
    travelled_m_ += kStep_m;
    coach_.addKeyframe(vehicle_, travelled_m_);
    if (!sees) {
      return;
    }
    const RigidTransform camera = trueExtrinsics().inverse() * motion * trueExtrinsics();
    MotionPair pair;
    pair.keyframe = static_cast<int32_t>(coach_.numKeyframes()) - 2;
    pair.vehicle = RigidTransform::planar(motion.translation().x(), odometer_sign * motion.translation().y(),
                                          odometer_sign * turn_rad);
    pair.camera_rotation = rotationFromVector(0.1 * noise()) * camera.rotation();
    if (pair.keyframe % 10 == 0) {
      common_ = common_error_rad / noise_rad_ * noise();
    }
    pair.camera_direction = rotationFromVector(noise() + common_) * camera.translation().normalized();
    pair.direction_sigma_rad = noise_rad_;
    pair.rotation_sigma_rad = 0.1 * noise_rad_;
    coach_.addMotion(0, pair);
  }

  Eigen::Vector3d noise() {
    std::normal_distribution<double> normal(0.0, noise_rad_);
    const double x = normal(random_), y = normal(random_), z = normal(random_);
    return {x, y, z};
  }

  std::mt19937 random_;
  const double noise_rad_;
  CalibrationCoach coach_;
  RigidTransform vehicle_;
  double travelled_m_ = 0.0;
  Eigen::Vector3d common_ = Eigen::Vector3d::Zero();
};

/// Two loops, one to the left and one to the right, that meet at their starts.
std::vector<Piece> figureOfEight() {
  return {{10.0, 0.0}, {40.0, 2.0 * M_PI}, {40.0, -2.0 * M_PI}, {20.0, 0.0}};
}

TEST(CalibrationCoachTest, ListsAllRequirementsForAStandingVehicle) {
  const DriveOutlook outlook = CoachedDrive().outlook();
  EXPECT_FALSE(outlook.isEnough());
  EXPECT_EQ(outlook.progress, 0.0);
  EXPECT_EQ(outlook.next, "turn left, 130 degrees more");  // 2.1 rad are 120.3 degrees
  EXPECT_EQ(outlook.missing.size(), 5U);
  EXPECT_TRUE(std::isnan(outlook.cameras[0].sigma[0]));
}

TEST(CalibrationCoachTest, NamesTheMissingTurn) {
  CoachedDrive drive;
  drive.drive({{20.0, 0.0}, {15.0, 90.0 * kDegree}});
  EXPECT_EQ(drive.outlook().next, "turn right, 130 degrees more");
  EXPECT_NEAR(drive.outlook().left_turn_rad, 90.0 * kDegree, 1e-9);
  drive.drive({{15.0, -50.0 * kDegree}});
  EXPECT_EQ(drive.outlook().next, "turn right, 80 degrees more");
  drive.drive({{15.0, -80.0 * kDegree}});
  EXPECT_EQ(drive.outlook().next, "turn left, 40 degrees more");
  EXPECT_NEAR(drive.outlook().right_turn_rad, 130.0 * kDegree, 1e-9);
}

TEST(CalibrationCoachTest, NamesTheStartOfTheDriveUntilARevisit) {
  CoachedDrive drive;
  drive.drive({{30.0, 140.0 * kDegree}, {30.0, -140.0 * kDegree}, {45.0, 0.0}});
  const DriveOutlook outlook = drive.outlook();
  EXPECT_EQ(outlook.next.find("revisit a place: the start of the drive is "), 0U) << outlook.next;
  EXPECT_NE(outlook.next.find("behind"), std::string::npos) << outlook.next;
  EXPECT_EQ(outlook.revisited_m, 0.0);
}

TEST(CalibrationCoachTest, IsSatisfiedByAFigureOfEight) {
  CoachedDrive drive;
  drive.drive(figureOfEight());
  const DriveOutlook outlook = drive.outlook();
  EXPECT_TRUE(outlook.isEnough()) << outlook.next;
  EXPECT_EQ(outlook.next, "you can stop now");
  EXPECT_EQ(outlook.progress, 1.0);
  EXPECT_TRUE(outlook.cameras[0].is_enough);
  EXPECT_GT(outlook.revisited_m, 10.0);
  EXPECT_TRUE(std::isnan(outlook.cameras[0].sigma[2])) << "planar motion does not show the height";
}

TEST(CalibrationCoachTest, ProgressReachesOneAtTheEnd) {
  CoachedDrive drive;
  double last = 0.0;
  for (const Piece& piece : figureOfEight()) {
    for (int i = 0; i < 4; ++i) {
      drive.drive({{piece.length_m / 4.0, piece.turn_rad / 4.0}});
      const DriveOutlook outlook = drive.outlook();
      EXPECT_GE(outlook.progress, 0.0);
      EXPECT_LE(outlook.progress, 1.0);
      EXPECT_EQ(outlook.progress == 1.0, outlook.isEnough());
      last = outlook.progress;
    }
  }
  EXPECT_EQ(last, 1.0);
}

TEST(CalibrationCoachTest, IsNeverSatisfiedByAStraightDrive) {
  CoachedDrive drive;
  drive.drive({{200.0, 0.0}});
  const DriveOutlook outlook = drive.outlook();
  EXPECT_EQ(outlook.cameras[0].hand_eye.status, HandEyeStatus::kNoTurn);
  EXPECT_EQ(outlook.progress, 0.0);
  EXPECT_EQ(outlook.missing.back(),
            "turn tightly to both sides: the position of camera 'left' is still unknown");
}

TEST(CalibrationCoachTest, NamesABlindCameraFirst) {
  CoachedDrive drive;
  drive.sees = false;
  drive.drive(figureOfEight());
  EXPECT_EQ(drive.outlook().next.find("camera 'left': too few images"), 0U) << drive.outlook().next;
  EXPECT_EQ(drive.outlook().progress, 0.0);
}

TEST(CalibrationCoachTest, NamesACameraThatContradictsTheOdometer) {
  CoachedDrive drive;
  drive.common_error_rad = 0.8;
  drive.drive(figureOfEight());
  const DriveOutlook outlook = drive.outlook();
  EXPECT_NE(outlook.next.find("camera 'left'"), std::string::npos) << outlook.next;
  EXPECT_FALSE(outlook.isEnough());
}

/// Mean squared error of hand-eye calibration relative to the predicted variance, per degree of freedom.
Eigen::Matrix<double, 6, 1> meanSquaredError(double common_error_rad, int num_drives) {
  Eigen::Matrix<double, 6, 1> sum = Eigen::Matrix<double, 6, 1>::Zero();
  for (int seed = 1; seed <= num_drives; ++seed) {
    CoachedDrive drive(static_cast<uint32_t>(seed));
    drive.common_error_rad = common_error_rad;
    drive.drive(figureOfEight());
    const CameraOutlook camera = drive.outlook().cameras[0];
    EXPECT_EQ(camera.hand_eye.status, HandEyeStatus::kOk);
    Eigen::Matrix<double, 6, 1> error;
    error << camera.hand_eye.vehicle_from_camera.translation() - trueExtrinsics().translation(),
        vectorFromRotation(camera.hand_eye.vehicle_from_camera.rotation() *
                           trueExtrinsics().rotation().conjugate());
    sum += error.cwiseQuotient(camera.sigma).cwiseAbs2();
  }
  return sum / num_drives;
}

TEST(CalibrationCoachTest, PredictedSigmasBoundTheErrorOfHandEye) {
  // 40 drives: the mean of squared normal errors is within 1 +- 4 sqrt(2 / 40). Predictions may be too
  // large, not too small.
  constexpr int kDrives = 40;
  const double most = 1.0 + 4.0 * std::sqrt(2.0 / kDrives);
  // Independent errors, and errors correlated over 5 m, which the formula does not model.
  for (const double common_error_rad : {0.0, 0.01}) {
    const Eigen::Matrix<double, 6, 1> squares = meanSquaredError(common_error_rad, kDrives);
    for (const int i : {0, 1, 3, 4, 5}) {
      EXPECT_LT(squares[i], most) << "degree of freedom " << i << ", common error " << common_error_rad;
      EXPECT_GT(squares[i], 0.01) << "degree of freedom " << i << ", common error " << common_error_rad;
    }
  }
}

TEST(CalibrationCoachTest, RefusesBadOptionsByName) {
  const auto refuse = [](const std::string& field, auto change) {
    CalibrationCoachOptions options;
    change(&options);
    try {
      CalibrationCoach({"left"}, HandEyeOptions(), options);
      FAIL() << field;
    } catch (const std::invalid_argument& error) {
      EXPECT_NE(std::string(error.what()).find(field), std::string::npos) << error.what();
    }
  };
  refuse("enough_turn_rad", [](auto* options) { options->enough_turn_rad = 0.0; });
}

}  // namespace
}  // namespace vcharge
