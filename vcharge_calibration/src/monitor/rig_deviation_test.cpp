// What a drive says about the rig, on analytic tracks.
#include "vcharge_calibration/monitor/rig_deviation.h"

#include <cmath>
#include <memory>

#include <gtest/gtest.h>

#include <Eigen/Cholesky>
#include <Eigen/LU>

#include "testing/analytic_drive.h"

namespace vcharge {
namespace {

/// Rotates and shifts the left camera of the rig, as if it had been knocked the other way.
void moveLeftCamera(const Eigen::Vector3d& shift_m, const Eigen::Vector3d& turn_rad,
                    ReconstructionData* data) {
  auto rig = std::make_shared<CameraRig>(*data->rig);
  RigidTransform& left = *rig->cameras[1].vehicle_from_camera;
  left = RigidTransform(rotationFromVector(-turn_rad) * left.rotation(), left.translation() - shift_m);
  data->rig = rig;
}

TEST(RigDeviationTest, SeesTheCameraThatMoved) {
  ReconstructionData data = testing::makeAnalyticDrive(1, testing::kNoise_px);
  const Eigen::Vector3d shift_m(0.01, 0.0, 0.02), turn_rad(0.004, -0.006, 0.005);
  moveLeftCamera(shift_m, turn_rad, &data);
  const RigDeviation deviation = estimateDeviation(RigCalibratorOptions(), KeyframeImages(), data);
  EXPECT_EQ(deviation.begin_m, 0.0);
  EXPECT_NEAR(deviation.end_m, 75.5, 1e-9);
  EXPECT_GT(deviation.num_observations[0], 1000);
  EXPECT_GT(deviation.num_observations[1], 1000);
  Eigen::MatrixXd information = deviation.information;
  information.diagonal().array() += 1.0;  // what is not seen at all
  const Eigen::VectorXd found = information.llt().solve(deviation.information_vector);
  const Eigen::MatrixXd covariance =
      information.llt().solve(Eigen::MatrixXd::Identity(information.rows(), information.cols()));
  Eigen::VectorXd truth = Eigen::VectorXd::Zero(deviation.size());
  truth.tail<6>() << shift_m, turn_rad;
  for (Eigen::Index i = 0; i < truth.size(); ++i) {
    EXPECT_NEAR(found[i], truth[i], 4.0 * std::sqrt(covariance(i, i))) << i;
  }
  EXPECT_LT(std::sqrt(covariance.bottomRightCorner<3, 3>().diagonal().maxCoeff()), 0.006);
}

TEST(RigDeviationTest, SeesTheSmallerWheel) {
  ReconstructionData data = testing::makeAnalyticDrive(2, testing::kNoise_px);
  constexpr double kTurnPerMetre_rad = 0.002;
  RigidTransform odom_from_vehicle;
  for (size_t i = 1; i < data.keyframes.size(); ++i) {
    const RigidTransform counted =
        data.keyframes[i - 1].map_from_vehicle.inverse() * data.keyframes[i].map_from_vehicle;
    odom_from_vehicle =
        odom_from_vehicle * counted * RigidTransform::planar(0.0, 0.0, -0.5 * kTurnPerMetre_rad);
    data.keyframes[i].odom_from_vehicle = odom_from_vehicle;
  }
  const RigDeviation deviation = estimateDeviation(RigCalibratorOptions(), KeyframeImages(), data);
  EXPECT_NEAR(deviation.information_vector[2] / deviation.information(2, 2), kTurnPerMetre_rad, 2e-4);
}

TEST(RigDeviationTest, ForgetsACamera) {
  RigDeviation deviation;
  const Eigen::Index size = RigDeviation::rowOf(2);
  const Eigen::MatrixXd root =
      Eigen::MatrixXd::Random(size, size) + 3.0 * Eigen::MatrixXd::Identity(size, size);
  deviation.information = root.transpose() * root;
  const Eigen::VectorXd found = Eigen::VectorXd::LinSpaced(size, -1.0, 1.0);
  deviation.information_vector = deviation.information * found;
  const Eigen::MatrixXd covariance = deviation.information.inverse();
  forgetCamera(1, &deviation);
  EXPECT_TRUE(deviation.information.bottomRows<6>().isZero(0.0));
  const Eigen::Index rest = RigDeviation::rowOf(1);
  const Eigen::MatrixXd marginal = deviation.information.topLeftCorner(rest, rest).inverse();
  EXPECT_TRUE(marginal.isApprox(covariance.topLeftCorner(rest, rest), 1e-9));
  EXPECT_TRUE((marginal * deviation.information_vector.head(rest)).isApprox(found.head(rest), 1e-9));
}

TEST(RigDeviationTest, KnowsNothingFromAShortPart) {
  ReconstructionData data = testing::makeAnalyticDrive(1, testing::kNoise_px);
  for (const size_t num_keyframes : {size_t{0}, size_t{2}}) {
    ReconstructionData part;
    part.rig = data.rig;
    part.keyframes.assign(data.keyframes.begin(), data.keyframes.begin() + static_cast<int>(num_keyframes));
    const RigDeviation deviation = estimateDeviation(RigCalibratorOptions(), KeyframeImages(), part);
    EXPECT_EQ(deviation.size(), 15);
    EXPECT_TRUE(deviation.information.isZero(0.0));
  }
}

}  // namespace
}  // namespace vcharge
