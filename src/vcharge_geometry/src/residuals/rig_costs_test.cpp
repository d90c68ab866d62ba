#include "vcharge_geometry/residuals/rig_costs.h"

#include <cmath>
#include <random>
#include <vector>

#include <ceres/ceres.h>
#include <gtest/gtest.h>

namespace vcharge {
namespace {

using Matrix6d = Eigen::Matrix<double, 6, 6>;

std::vector<CameraModel> models() {
  Eigen::Matrix<double, 9, 1> mei;
  mei << 1.15, 895.5, 894.7, 649.6, 398.7, -0.33, 0.0865, -0.00067, -0.00004;
  Eigen::Matrix<double, 8, 1> kannala_brandt;
  kannala_brandt << 330.0, 331.0, 640.0, 400.0, 0.01, -0.004, 0.001, -0.0002;
  const Eigen::VectorXd pinhole =
      (Eigen::VectorXd(8) << 500.0, 505.0, 640.0, 400.0, -0.05, 0.01, 0.001, -0.0005).finished();
  return {CameraModel::create("mei", mei), CameraModel::create("kannala_brandt", kannala_brandt),
          CameraModel::create("pinhole", pinhole)};
}

class RigCostsTest : public ::testing::Test {
 protected:
  double uniform(double low, double high) {
    return std::uniform_real_distribution<double>(low, high)(random_);
  }
  Eigen::Vector3d vector(double size) {
    const double x = uniform(-size, size);
    const double y = uniform(-size, size);
    const double z = uniform(-size, size);
    return {x, y, z};
  }
  RigidTransform pose(double metres, double radians) {
    const Eigen::Quaterniond rotation = rotationFromVector(vector(radians));
    return RigidTransform(rotation, vector(metres));
  }
  Matrix6d information() {
    Matrix6d root = Matrix6d::Identity();
    for (int i = 0; i < 36; ++i) {
      root(i / 6, i % 6) += uniform(-0.3, 0.3);
    }
    return root.transpose() * root;
  }

  /// Largest difference between the analytic Jacobians in the tangent space and central differences, relative
  /// to 1 + their magnitude.
  static double jacobianError(const ceres::CostFunction& cost, std::vector<std::vector<double>> blocks) {
    const std::unique_ptr<ceres::Manifold> manifold = makePoseManifold();
    const int rows = cost.num_residuals();
    std::vector<std::vector<double>> storage;
    std::vector<double*> jacobians;
    for (const int size : cost.parameter_block_sizes()) {
      storage.emplace_back(static_cast<size_t>(rows * size));
    }
    for (auto& entry : storage) {
      jacobians.push_back(entry.data());
    }
    const auto pointers = [&blocks] {
      std::vector<const double*> result;
      for (const auto& block : blocks) {
        result.push_back(block.data());
      }
      return result;
    };
    Eigen::VectorXd residuals(rows);
    EXPECT_TRUE(cost.Evaluate(pointers().data(), residuals.data(), jacobians.data()));
    double worst = 0.0;
    for (size_t b = 0; b < blocks.size(); ++b) {
      const auto ambient = static_cast<int>(blocks[b].size());
      const bool is_pose = ambient == 7;
      const int tangent = is_pose ? 6 : ambient;
      const Eigen::Map<Eigen::Matrix<double, Eigen::Dynamic, Eigen::Dynamic, Eigen::RowMajor>> jacobian(
          jacobians[b], rows, ambient);
      Eigen::Matrix<double, Eigen::Dynamic, Eigen::Dynamic, Eigen::RowMajor> plus =
          Eigen::MatrixXd::Identity(ambient, tangent);
      if (is_pose) {
        manifold->PlusJacobian(blocks[b].data(), plus.data());
      }
      const Eigen::MatrixXd analytic = jacobian * plus;
      const std::vector<double> centre = blocks[b];
      for (int k = 0; k < tangent; ++k) {
        const double step = 1e-6 * (is_pose ? 1.0 : std::max(1.0, std::abs(centre[static_cast<size_t>(k)])));
        Eigen::MatrixXd sides(rows, 2);
        for (int side = 0; side < 2; ++side) {
          Eigen::VectorXd delta = Eigen::VectorXd::Zero(tangent);
          delta[k] = side == 0 ? -step : step;
          if (is_pose) {
            manifold->Plus(centre.data(), delta.data(), blocks[b].data());
          } else {
            blocks[b][static_cast<size_t>(k)] = centre[static_cast<size_t>(k)] + delta[k];
          }
          Eigen::VectorXd moved(rows);
          EXPECT_TRUE(cost.Evaluate(pointers().data(), moved.data(), nullptr));
          sides.col(side) = moved;
          blocks[b] = centre;
        }
        const Eigen::VectorXd numeric = (sides.col(1) - sides.col(0)) / (2.0 * step);
        worst = std::max(worst, (numeric - analytic.col(k)).norm() / (1.0 + analytic.col(k).norm()));
      }
    }
    return worst;
  }
  static std::vector<double> block(const RigidTransform& transform) {
    const PoseBlock pose_block = toPoseBlock(transform);
    return {pose_block.begin(), pose_block.end()};
  }
  static std::vector<double> block(const Eigen::VectorXd& values) {
    return {values.data(), values.data() + values.size()};
  }

  std::mt19937 random_{7};
};

TEST_F(RigCostsTest, ReprojectionVanishesAtTheTruthAndItsJacobiansAreRight) {
  for (const CameraModel& model : models()) {
    int tested = 0;
    for (int i = 0; i < 200; ++i) {
      const RigidTransform map_from_vehicle = pose(20.0, 1.0);
      const RigidTransform vehicle_from_camera = pose(2.0, 1.0);
      Eigen::Vector3d point_in_camera = vector(5.0);
      point_in_camera.z() = std::abs(point_in_camera.z()) + 0.5;
      Eigen::Vector2d pixel;
      if (!model.project(point_in_camera, &pixel)) {
        continue;
      }
      const Eigen::Vector3d point = map_from_vehicle * (vehicle_from_camera * point_in_camera);
      const auto cost = makeReprojectionCost(model, pixel, 0.5);
      const std::vector<std::vector<double>> blocks = {block(map_from_vehicle), block(vehicle_from_camera),
                                                       block(model.parameters()), block(point)};
      const std::vector<const double*> pointers = {blocks[0].data(), blocks[1].data(), blocks[2].data(),
                                                   blocks[3].data()};
      Eigen::Vector2d residuals;
      ASSERT_TRUE(cost->Evaluate(pointers.data(), residuals.data(), nullptr));
      EXPECT_LT(residuals.norm(), 1e-8);
      EXPECT_LT(jacobianError(*cost, blocks), 2e-5) << model.name();
      const auto known = makeReprojectionCost(std::make_shared<const CameraModel>(model), pixel, 0.5);
      EXPECT_LT(jacobianError(*known, {blocks[0], blocks[1], blocks[3]}), 2e-5) << model.name();
      ++tested;
    }
    EXPECT_GT(tested, 50) << model.name();
  }
}

TEST_F(RigCostsTest, PointBehindTheCameraCostsMuchAndPullsNowhere) {
  const CameraModel pinhole = models()[2];
  const auto cost = makeReprojectionCost(std::make_shared<const CameraModel>(pinhole), {640.0, 400.0}, 2.0);
  const PoseBlock identity = toPoseBlock(RigidTransform());
  const Eigen::Vector3d behind(0.1, 0.2, -3.0);
  const std::vector<const double*> blocks = {identity.data(), identity.data(), behind.data()};
  Eigen::Vector2d residuals;
  std::vector<double> by_vehicle(14, 1.0);
  std::vector<double> by_camera(14, 1.0);
  std::vector<double> by_point(6, 1.0);
  std::vector<double*> jacobians = {by_vehicle.data(), by_camera.data(), by_point.data()};
  ASSERT_TRUE(cost->Evaluate(blocks.data(), residuals.data(), jacobians.data()));
  EXPECT_NEAR(residuals.x(), kNoImageResidual, 1e-9);
  for (const auto& jacobian : {by_vehicle, by_camera, by_point}) {
    for (const double value : jacobian) {
      EXPECT_EQ(value, 0.0);
    }
  }
}

TEST_F(RigCostsTest, IntrinsicsOutsideTheModelFailTheEvaluation) {
  const CameraModel mei = models()[0];
  const auto cost = makeReprojectionCost(mei, {640.0, 400.0}, 1.0);
  Eigen::VectorXd bad = mei.parameters();
  bad[1] = -1.0;
  const PoseBlock identity = toPoseBlock(RigidTransform());
  const Eigen::Vector3d point(0.1, 0.2, 3.0);
  const std::vector<const double*> blocks = {identity.data(), identity.data(), bad.data(), point.data()};
  Eigen::Vector2d residuals;
  EXPECT_FALSE(cost->Evaluate(blocks.data(), residuals.data(), nullptr));
}

TEST_F(RigCostsTest, OdometryAgreesWithAnArcAndItsJacobiansAreRight) {
  for (int i = 0; i < 100; ++i) {
    // On this arc, the odometer counted 2 % too much distance and 3 % too little turn.
    const double distance_m = uniform(0.1, 1.0);
    const double turn_rad = uniform(-0.4, 0.4);
    const auto arc = [](double distance, double turn) {
      const double chord = std::abs(turn) < 1e-9 ? distance : 2.0 * distance / turn * std::sin(0.5 * turn);
      return RigidTransform::planar(chord * std::cos(0.5 * turn), chord * std::sin(0.5 * turn), turn);
    };
    const RigidTransform map_from_previous = pose(10.0, 1.0);
    const RigidTransform map_from_current = map_from_previous * arc(distance_m, turn_rad);
    const auto cost = makeOdometryCost(arc(1.02 * distance_m, 0.97 * turn_rad), information());
    const std::vector<std::vector<double>> blocks = {
        block(map_from_previous), block(map_from_current), {1.0 / 1.02, 1.0 / 0.97}};
    const std::vector<const double*> pointers = {blocks[0].data(), blocks[1].data(), blocks[2].data()};
    Eigen::Matrix<double, 6, 1> residuals;
    ASSERT_TRUE(cost->Evaluate(pointers.data(), residuals.data(), nullptr));
    // The length of the chord depends on the turn only to second order.
    EXPECT_LT(residuals.norm(), 2e-3 * distance_m);
    const std::vector<std::vector<double>> elsewhere = {
        block(map_from_previous), block(pose(10.0, 1.0)), {0.9, 1.1}};
    EXPECT_LT(jacobianError(*cost, elsewhere), 1e-5);
  }
}

TEST_F(RigCostsTest, BundleAdjustmentFindsPosesAndExtrinsicsAgain) {
  // Two cameras, five poses, and points around them; the first pose and the distance to the second fix the
  // gauge.
  const CameraModel mei = models()[0];
  const auto camera = std::make_shared<const CameraModel>(mei);
  const std::vector<RigidTransform> vehicle_from_camera = {pose(1.0, 0.4), pose(1.0, 0.4)};
  std::vector<RigidTransform> map_from_vehicle;
  for (int i = 0; i < 5; ++i) {
    map_from_vehicle.push_back(RigidTransform::planar(0.8 * i, 0.1 * i * i, 0.12 * i) * pose(0.02, 0.02));
  }
  std::vector<Eigen::Vector3d> points;
  for (int i = 0; i < 120; ++i) {
    const Eigen::Vector3d offset = vector(4.0);
    points.push_back(offset + Eigen::Vector3d(0.0, 0.0, 6.0));
  }
  std::vector<PoseBlock> poses;
  std::vector<PoseBlock> extrinsics;
  for (const RigidTransform& truth : map_from_vehicle) {
    poses.push_back(toPoseBlock(poses.empty() ? truth : truth * pose(0.05, 0.02)));
  }
  for (const RigidTransform& truth : vehicle_from_camera) {
    extrinsics.push_back(toPoseBlock(truth * pose(0.05, 0.02)));
  }
  std::vector<Eigen::Vector3d> estimates;
  ceres::Problem::Options ownership;
  ownership.manifold_ownership = ceres::DO_NOT_TAKE_OWNERSHIP;
  const std::unique_ptr<ceres::Manifold> manifold = makePoseManifold();
  ceres::Problem problem(ownership);
  for (const Eigen::Vector3d& point : points) {
    estimates.push_back(point + vector(0.1));
  }
  for (PoseBlock& block : poses) {
    problem.AddParameterBlock(block.data(), 7, manifold.get());
  }
  for (PoseBlock& block : extrinsics) {
    problem.AddParameterBlock(block.data(), 7, manifold.get());
  }
  int observations = 0;
  for (size_t p = 0; p < poses.size(); ++p) {
    for (size_t c = 0; c < extrinsics.size(); ++c) {
      for (size_t k = 0; k < points.size(); ++k) {
        Eigen::Vector2d pixel;
        if (mei.project(vehicle_from_camera[c].inverse() * (map_from_vehicle[p].inverse() * points[k]),
                        &pixel)) {
          problem.AddResidualBlock(makeReprojectionCost(camera, pixel, 1.0).release(), nullptr,
                                   poses[p].data(), extrinsics[c].data(), estimates[k].data());
          ++observations;
        }
      }
    }
  }
  ASSERT_GT(observations, 800);
  std::array<double, 2> odometer = {1.0, 1.0};
  for (size_t p = 0; p + 1 < poses.size(); ++p) {
    problem.AddResidualBlock(
        makeOdometryCost(map_from_vehicle[p].inverse() * map_from_vehicle[p + 1], Matrix6d::Identity() * 1e-6)
            .release(),
        nullptr, poses[p].data(), poses[p + 1].data(), odometer.data());
  }
  problem.SetParameterBlockConstant(odometer.data());
  problem.SetParameterBlockConstant(poses[0].data());
  // The baseline between the cameras determines the scale: fix one of them.
  problem.SetParameterBlockConstant(extrinsics[0].data());
  extrinsics[0] = toPoseBlock(vehicle_from_camera[0]);
  poses[1] = toPoseBlock(map_from_vehicle[1]);
  problem.SetParameterBlockConstant(poses[1].data());
  ceres::Solver::Options options;
  options.linear_solver_type = ceres::DENSE_SCHUR;
  options.max_num_iterations = 60;
  options.function_tolerance = 1e-16;
  options.gradient_tolerance = 1e-14;
  options.parameter_tolerance = 1e-14;
  ceres::Solver::Summary summary;
  ceres::Solve(options, &problem, &summary);
  for (size_t p = 0; p < poses.size(); ++p) {
    const RigidTransform error = map_from_vehicle[p].inverse() * fromPoseBlock(poses[p]);
    EXPECT_LT(error.translation().norm(), 1e-5) << summary.BriefReport();
    EXPECT_LT(angleOfRotation(error.rotation()), 1e-5);
  }
  const RigidTransform error = vehicle_from_camera[1].inverse() * fromPoseBlock(extrinsics[1]);
  EXPECT_LT(error.translation().norm(), 1e-5);
  EXPECT_LT(angleOfRotation(error.rotation()), 1e-5);
}

TEST_F(RigCostsTest, BadInformationIsACallersBug) {
  Matrix6d negative = Matrix6d::Identity();
  negative(2, 2) = -1.0;
  Matrix6d lopsided = Matrix6d::Identity();
  lopsided(0, 1) = 0.5;
  for (const Matrix6d& bad : {negative, lopsided}) {
    EXPECT_THROW(makeOdometryCost(RigidTransform(), bad), std::logic_error);
  }
  EXPECT_THROW(makeReprojectionCost(models()[0], {1.0, 2.0}, 0.0), std::logic_error);
}

}  // namespace
}  // namespace vcharge
