#include "vcharge_calibration/initialization/hand_eye.h"

#include <algorithm>
#include <cmath>

#include <Eigen/Cholesky>
#include <Eigen/Eigenvalues>
#include <Eigen/LU>

namespace vcharge {
namespace {

constexpr int kMinMotions = 6;
/// Scale of the Cauchy loss, in standard deviations.
constexpr double kLossSigmas = 2.0;
/// Motions with larger errors are outliers.
constexpr double kMaxInlierSigmas = 5.0;

double cauchyWeight(double sigmas, double scale) {
  return 1.0 / (1.0 + sigmas * sigmas / (scale * scale));
}

double yawOf(const MotionPair& motion) {
  return yawOfRotation(motion.vehicle.rotation());
}

/// The vertical in the camera's frame and its standard deviation.
struct Vertical {
  Eigen::Vector3d up_in_camera = Eigen::Vector3d::UnitZ();
  double sigma_rad = INFINITY;
  std::vector<double> weights;
};

Vertical findVertical(const std::vector<MotionPair>& motions, const HandEyeOptions& options,
                      int num_iterations) {
  Vertical result;
  result.weights.assign(motions.size(), 1.0);
  for (int iteration = 0; iteration < num_iterations; ++iteration) {
    Eigen::Matrix3d information = Eigen::Matrix3d::Zero();
    Eigen::Vector3d right_side = Eigen::Vector3d::Zero();
    for (size_t i = 0; i < motions.size(); ++i) {
      const double turn_variance = motions[i].rotation_sigma_rad * motions[i].rotation_sigma_rad +
                                   options.odometry_sigma_rad * options.odometry_sigma_rad;
      const double yaw_rad = yawOf(motions[i]);
      information += result.weights[i] * yaw_rad * yaw_rad / turn_variance * Eigen::Matrix3d::Identity();
      right_side +=
          result.weights[i] * yaw_rad / turn_variance * vectorFromRotation(motions[i].camera_rotation);
      if (motions[i].has_direction) {
        const Eigen::Vector3d& direction = motions[i].camera_direction;
        information += result.weights[i] / (motions[i].direction_sigma_rad * motions[i].direction_sigma_rad) *
                       direction * direction.transpose();
      }
    }
    const Eigen::SelfAdjointEigenSolver<Eigen::Matrix3d> eigen(information);
    if (!(eigen.eigenvalues()[0] > 1e-9)) {
      return result;
    }
    const Eigen::Vector3d vertical = information.ldlt().solve(right_side);
    if (!(vertical.norm() > 1e-9)) {
      return result;
    }
    result.up_in_camera = vertical.normalized();
    // Information matrix of the vertical's tilt.
    const Eigen::Vector3d side = result.up_in_camera.unitOrthogonal();
    Eigen::Matrix<double, 3, 2> across;
    across << side, result.up_in_camera.cross(side);
    const Eigen::SelfAdjointEigenSolver<Eigen::Matrix2d> of_tilt(
        Eigen::Matrix2d(across.transpose() * information * across));
    result.sigma_rad = 1.0 / std::sqrt(std::max(1e-12, of_tilt.eigenvalues()[0]));
    for (size_t i = 0; i < motions.size(); ++i) {
      const double turn_sigma = std::hypot(motions[i].rotation_sigma_rad, options.odometry_sigma_rad);
      double sigmas =
          (vectorFromRotation(motions[i].camera_rotation) - yawOf(motions[i]) * result.up_in_camera).norm() /
          turn_sigma;
      if (motions[i].has_direction) {
        sigmas = std::hypot(
            sigmas, motions[i].camera_direction.dot(result.up_in_camera) / motions[i].direction_sigma_rad);
      }
      result.weights[i] = cauchyWeight(sigmas, kLossSigmas);
    }
  }
  return result;
}

/// Yaw and position of a camera in a levelled frame.
struct PlanarPose {
  Eigen::Vector2d cos_sin{1.0, 0.0};
  Eigen::Vector2d turned_position_m = Eigen::Vector2d::Zero();  ///< position u, see solvePlanarHandEye()
  double yaw_sigma_rad = INFINITY, position_sigma_m = INFINITY;
  std::vector<double> sigmas;  ///< standardized error of each motion
};

/// Expected motion of the camera, Rz(-alpha) t + (R - I) u.
Eigen::Vector2d predictedMotion(const MotionPair& motion, const PlanarPose& pose) {
  const Eigen::Rotation2Dd turn(yawOf(motion));
  Eigen::Matrix2d back;
  back << pose.cos_sin[0], pose.cos_sin[1], -pose.cos_sin[1], pose.cos_sin[0];
  return back * motion.vehicle.translation().head<2>() +
         (turn.toRotationMatrix() - Eigen::Matrix2d::Identity()) * pose.turned_position_m;
}

PlanarPose findPlanarPose(const std::vector<MotionPair>& motions,
                          const std::vector<Eigen::Vector2d>& directions, const HandEyeOptions& options,
                          int num_iterations) {
  PlanarPose pose;
  pose.sigmas.assign(motions.size(), 0.0);
  std::vector<double> lengths_m;
  for (const MotionPair& motion : motions) {
    lengths_m.push_back(motion.vehicle.translation().norm());
  }
  for (int iteration = 0; iteration < num_iterations; ++iteration) {
    Eigen::Matrix4d information = Eigen::Matrix4d::Zero();
    for (size_t i = 0; i < motions.size(); ++i) {
      if (!motions[i].has_direction) {
        continue;
      }
      const Eigen::Vector2d across(-directions[i].y(), directions[i].x());
      const Eigen::Vector2d moved = motions[i].vehicle.translation().head<2>();
      const double sigma_m =
          std::hypot(lengths_m[i] * motions[i].direction_sigma_rad, options.odometry_sigma_m);
      Eigen::Vector4d row;
      row[0] = across.dot(moved);
      row[1] = across.dot(Eigen::Vector2d(moved.y(), -moved.x()));
      row.tail<2>() = (Eigen::Rotation2Dd(yawOf(motions[i])).toRotationMatrix() - Eigen::Matrix2d::Identity())
                          .transpose() *
                      across;
      information += cauchyWeight(pose.sigmas[i], kLossSigmas) / (sigma_m * sigma_m) * row * row.transpose();
    }
    // After elimination of the position, the eigenvector of the smaller eigenvalue is cosine and sine of the
    // yaw.
    const Eigen::Matrix2d position_information =
        information.bottomRightCorner<2, 2>() + 1e-6 * Eigen::Matrix2d::Identity();
    const Eigen::Matrix2d position_by_yaw =
        position_information.ldlt().solve(information.bottomLeftCorner<2, 2>());
    const Eigen::Matrix2d yaw_information =
        information.topLeftCorner<2, 2>() - information.topRightCorner<2, 2>() * position_by_yaw;
    const Eigen::SelfAdjointEigenSolver<Eigen::Matrix2d> eigen(yaw_information);
    pose.cos_sin = eigen.eigenvectors().col(0);
    pose.turned_position_m = -position_by_yaw * pose.cos_sin;
    double forwards = 0.0;
    for (size_t i = 0; i < motions.size(); ++i) {
      if (motions[i].has_direction) {
        forwards += directions[i].dot(predictedMotion(motions[i], pose));
      }
    }
    if (forwards < 0.0) {
      pose.cos_sin = -pose.cos_sin;
      pose.turned_position_m = -pose.turned_position_m;
    }
    pose.yaw_sigma_rad = 1.0 / std::sqrt(std::max(1e-12, eigen.eigenvalues()[1]));
    pose.position_sigma_m =
        1.0 /
        std::sqrt(std::max(
            1e-12, Eigen::SelfAdjointEigenSolver<Eigen::Matrix2d>(position_information).eigenvalues()[0]));
    for (size_t i = 0; i < motions.size(); ++i) {
      if (!motions[i].has_direction) {
        continue;
      }
      const Eigen::Vector2d predicted = predictedMotion(motions[i], pose);
      lengths_m[i] = predicted.norm();
      const double sigma_m =
          std::hypot(lengths_m[i] * motions[i].direction_sigma_rad, options.odometry_sigma_m);
      const Eigen::Vector2d across(-directions[i].y(), directions[i].x());
      // A motion in the opposite direction gets the same error as a perpendicular one.
      const double error_m = directions[i].dot(predicted) < 0.0 ? lengths_m[i] : across.dot(predicted);
      pose.sigmas[i] = error_m / sigma_m;
    }
  }
  return pose;
}

/// Robust mean direction of straight motions.
Eigen::Vector3d findTravel(const std::vector<MotionPair>& motions, int num_iterations) {
  constexpr double kStraight_rad = 0.02;
  Eigen::Vector3d travel = Eigen::Vector3d::Zero();
  for (int iteration = 0; iteration < num_iterations; ++iteration) {
    Eigen::Vector3d sum = Eigen::Vector3d::Zero();
    for (const MotionPair& motion : motions) {
      if (motion.has_direction && std::abs(yawOf(motion)) < kStraight_rad) {
        const double forwards = motion.vehicle.translation().x() < 0.0 ? -1.0 : 1.0;
        const Eigen::Vector3d direction = forwards * motion.camera_direction;
        const double sigma = std::hypot(motion.direction_sigma_rad, kStraight_rad);
        const double sigmas = iteration == 0 ? 0.0 : (direction - travel).norm() / sigma;
        sum += cauchyWeight(sigmas, kLossSigmas) / (sigma * sigma) * direction;
      }
    }
    if (!(sum.norm() > 0.0)) {
      return Eigen::Vector3d::Zero();
    }
    travel = sum.normalized();
  }
  return travel;
}

}  // namespace

HandEye solvePlanarHandEye(const std::vector<MotionPair>& motions, const HandEyeOptions& options,
                           int num_iterations) {
  options.validate();
  HandEye result;
  result.num_motions = static_cast<int>(motions.size());
  if (result.num_motions < kMinMotions) {
    return result;
  }
  result.travel_in_camera = findTravel(motions, num_iterations);
  const Vertical vertical = findVertical(motions, options, num_iterations);
  result.tilt_sigma_rad = vertical.sigma_rad;
  const Eigen::Quaterniond level_from_camera =
      Eigen::Quaterniond::FromTwoVectors(vertical.up_in_camera, Eigen::Vector3d::UnitZ());
  std::vector<Eigen::Vector2d> directions;
  for (const MotionPair& motion : motions) {
    directions.emplace_back((level_from_camera * motion.camera_direction).head<2>().normalized());
  }
  const PlanarPose pose = findPlanarPose(motions, directions, options, num_iterations);
  result.yaw_sigma_rad = pose.yaw_sigma_rad;
  result.position_sigma_m = pose.position_sigma_m;
  for (size_t i = 0; i < motions.size(); ++i) {
    const double turn_error_sigmas = (1.0 / vertical.weights[i] - 1.0) * kLossSigmas * kLossSigmas;
    result.num_inliers +=
        std::abs(pose.sigmas[i]) < kMaxInlierSigmas && turn_error_sigmas < kMaxInlierSigmas * kMaxInlierSigmas
            ? 1
            : 0;
  }
  if (!(result.tilt_sigma_rad < options.max_sigma_rad && result.yaw_sigma_rad < options.max_sigma_rad &&
        result.position_sigma_m < options.max_sigma_m)) {
    result.status = HandEyeStatus::kNoTurn;
    return result;
  }
  const double yaw_rad = std::atan2(pose.cos_sin[1], pose.cos_sin[0]);
  const Eigen::Vector2d position_m = Eigen::Rotation2Dd(yaw_rad) * pose.turned_position_m;
  result.vehicle_from_camera = RigidTransform(rotationFromYawPitchRoll(yaw_rad, 0.0, 0.0) * level_from_camera,
                                              Eigen::Vector3d(position_m.x(), position_m.y(), 0.0));
  result.status =
      2 * result.num_inliers > result.num_motions ? HandEyeStatus::kOk : HandEyeStatus::kNoAgreement;
  return result;
}

}  // namespace vcharge
