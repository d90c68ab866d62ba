#include "vcharge_wheel_odometry/wheel_calibration.h"

#include <algorithm>
#include <cmath>
#include <optional>
#include <utility>

#include <Eigen/Cholesky>
#include <Eigen/QR>

#include "vcharge_core/base/text_format.h"

namespace vcharge {
namespace {

// Parameters: relative scale, relative excess of the right wheel over the left one, relative track width.
using Parameters = Eigen::Vector3d;
const Parameters kNominal(1.0, 0.0, 1.0);
const Parameters kPriorSigma(0.03, 0.01, 0.03);

constexpr double kMinPath_m = 50.0;
constexpr double kMaxSubPath_m = 100.0;
constexpr int kMinSubPaths = 4;  // that fit without overlap
constexpr int kOverlap = 4;      // sub-paths begin at every quarter of their length
// Errors of calibrated wheels and of references over a sub-path.
constexpr double kPositionSigmaRatio = 0.005;
constexpr double kYawSigma_rad = 0.005;
constexpr double kGoodError = 2.0;  // standard deviations beyond which a sub-path loses weight
constexpr int kHuberIterations = 6, kCauchyIterations = 12;

double normalized(double angle) {
  return std::remainder(angle, 2.0 * M_PI);
}

struct PlanarPose {
  Timestamp stamp;
  Eigen::Vector2d position_m;
  double yaw_rad;
};

PlanarPose planarPose(const StampedTransform& pose) {
  return {pose.stamp, pose.world_from_vehicle.translation().head<2>(),
          yawOfRotation(pose.world_from_vehicle.rotation())};
}

WheelOdometryOptions withParameters(const WheelOdometryOptions& nominal, const Parameters& parameters) {
  WheelOdometryOptions options = nominal;
  options.left_scale *= parameters[0] * (1.0 - 0.5 * parameters[1]);
  options.right_scale *= parameters[0] * (1.0 + 0.5 * parameters[1]);
  options.track_width_m *= parameters[2];
  return options;
}

std::vector<PlanarPose> deadReckoning(const std::vector<WheelMeasurement>& wheels,
                                      const WheelOdometryOptions& options) {
  std::vector<PlanarPose> path;
  const WheelMeasurement* before = nullptr;
  for (const WheelMeasurement& now : wheels) {
    if (before == nullptr) {
      path.push_back({stampOf(now), Eigen::Vector2d::Zero(), 0.0});
    } else if (stampOf(now) <= stampOf(*before)) {
      continue;
    } else {
      const WheelMotion motion = wheelMotion(*before, now, 0.0, options);
      const double turn_rad = (motion.right_m - motion.left_m) / options.track_width_m;
      const RigidTransform arc = arcMotion(0.5 * (motion.left_m + motion.right_m), turn_rad);
      const PlanarPose& last = path.back();
      path.push_back({stampOf(now),
                      last.position_m + Eigen::Rotation2Dd(last.yaw_rad) * arc.translation().head<2>(),
                      last.yaw_rad + turn_rad});
    }
    before = &now;
  }
  return path;
}

std::optional<PlanarPose> interpolated(const std::vector<PlanarPose>& path, Timestamp stamp) {
  const auto after = std::lower_bound(path.begin(), path.end(), stamp,
                                      [](const PlanarPose& pose, Timestamp at) { return pose.stamp < at; });
  if (after == path.end() || (after == path.begin() && stamp < after->stamp)) {
    return std::nullopt;
  }
  if (after->stamp == stamp) {
    return *after;
  }
  const PlanarPose& before = *(after - 1);
  const double fraction = toSeconds(stamp - before.stamp) / toSeconds(after->stamp - before.stamp);
  return PlanarPose{stamp, before.position_m + fraction * (after->position_m - before.position_m),
                    before.yaw_rad + fraction * (after->yaw_rad - before.yaw_rad)};
}

struct SubPath {
  PlanarPose begin, end;  // of the reference
  double length_m;
};

std::vector<SubPath> subPaths(const std::vector<PlanarPose>& reference, double* path_m) {
  std::vector<double> travelled_m;
  for (size_t i = 0; i < reference.size(); ++i) {
    travelled_m.push_back(
        i == 0 ? 0.0 : travelled_m.back() + (reference[i].position_m - reference[i - 1].position_m).norm());
  }
  *path_m = travelled_m.empty() ? 0.0 : travelled_m.back();
  const double length_m = std::min(kMaxSubPath_m, *path_m / kMinSubPaths);
  std::vector<SubPath> result;
  double next_m = 0.0;
  for (size_t i = 0; i < reference.size() && length_m > 0.0; ++i) {
    if (travelled_m[i] < next_m) {
      continue;
    }
    const auto end = std::lower_bound(travelled_m.begin(), travelled_m.end(), travelled_m[i] + length_m);
    if (end == travelled_m.end()) {
      break;
    }
    result.push_back({reference[i], reference[static_cast<size_t>(end - travelled_m.begin())], length_m});
    next_m = travelled_m[i] + length_m / kOverlap;
  }
  return result;
}

Eigen::VectorXd residuals(const std::vector<WheelMeasurement>& wheels, const WheelOdometryOptions& options,
                          const std::vector<SubPath>& sub_paths) {
  const std::vector<PlanarPose> path = deadReckoning(wheels, options);
  Eigen::VectorXd result(3 * static_cast<int>(sub_paths.size()));
  int row = 0;
  for (const SubPath& each : sub_paths) {
    const PlanarPose begin = *interpolated(path, each.begin.stamp);
    const PlanarPose end = *interpolated(path, each.end.stamp);
    const Eigen::Vector2d error_m =
        Eigen::Rotation2Dd(-begin.yaw_rad) * (end.position_m - begin.position_m) -
        Eigen::Rotation2Dd(-each.begin.yaw_rad) * (each.end.position_m - each.begin.position_m);
    const double yaw_error_rad =
        normalized(end.yaw_rad - begin.yaw_rad - (each.end.yaw_rad - each.begin.yaw_rad));
    result.segment<3>(row) << error_m / (kPositionSigmaRatio * each.length_m), yaw_error_rad / kYawSigma_rad;
    row += 3;
  }
  return result;
}

/// Weights of Huber, whose sum of errors has one minimum, then of Cauchy, with which outliers have no effect.
Eigen::VectorXd robustWeights(const Eigen::VectorXd& error, bool use_huber) {
  Eigen::VectorXd weights(error.size());
  for (int i = 0; i < error.size(); i += 3) {
    const double relative = error.segment<3>(i).norm() / kGoodError;
    const double weight = use_huber ? 1.0 / std::max(1.0, relative) : 1.0 / (1.0 + relative * relative);
    weights.segment<3>(i).setConstant(weight / kOverlap);
  }
  return weights;
}

struct Normal {
  Eigen::Matrix3d information;
  Eigen::Vector3d gradient;
  double error_variance;  // relative to the assumed one
};

Normal normalEquations(const std::vector<WheelMeasurement>& wheels, const WheelOdometryOptions& nominal,
                       const std::vector<SubPath>& sub_paths, const Parameters& parameters, bool use_huber) {
  const Eigen::VectorXd error = residuals(wheels, withParameters(nominal, parameters), sub_paths);
  Eigen::MatrixXd jacobian(error.size(), 3);
  for (int i = 0; i < 3; ++i) {
    constexpr double kStep = 1e-5;
    const Parameters step = Parameters::Unit(i) * kStep;
    jacobian.col(i) = (residuals(wheels, withParameters(nominal, parameters + step), sub_paths) -
                       residuals(wheels, withParameters(nominal, parameters - step), sub_paths)) /
                      (2.0 * kStep);
  }
  const Eigen::VectorXd weights = robustWeights(error, use_huber);
  const Parameters prior = kPriorSigma.array().square().inverse();
  Normal normal;
  normal.error_variance = error.cwiseProduct(weights).dot(error) / weights.sum();
  normal.information = jacobian.transpose() * weights.asDiagonal() * jacobian;
  normal.information += prior.asDiagonal();
  normal.gradient = jacobian.transpose() * weights.asDiagonal() * error;
  normal.gradient += prior.asDiagonal() * (parameters - kNominal);
  return normal;
}

}  // namespace

WheelCalibration calibrateWheels(const std::vector<WheelMeasurement>& wheels, const Trajectory& reference,
                                 const WheelOdometryOptions& nominal) {
  nominal.validate();
  WheelCalibration result;
  result.options = nominal;
  const std::vector<PlanarPose> path = deadReckoning(wheels, nominal);
  std::vector<PlanarPose> covered;
  for (const StampedTransform& pose : reference) {
    if (interpolated(path, pose.stamp)) {
      covered.push_back(planarPose(pose));
    }
  }
  const std::vector<SubPath> sub_paths = subPaths(covered, &result.distance_m);
  if (result.distance_m < kMinPath_m) {
    result.reason = "wheels and reference poses have " + toText(result.distance_m, 1) +
                    " m in common, at least " + toText(kMinPath_m, 0) + " m are needed";
    return result;
  }
  Parameters parameters = kNominal;
  Normal normal;
  for (int i = 0; i < kHuberIterations + kCauchyIterations; ++i) {
    normal = normalEquations(wheels, nominal, sub_paths, parameters, i < kHuberIterations);
    parameters -= normal.information.ldlt().solve(normal.gradient);
  }
  const Parameters sigma =
      (normal.information.inverse().diagonal() * std::max(1.0, normal.error_variance)).cwiseSqrt();
  const auto parameter = [&](int i, double value, double unit) {
    return CalibratedParameter{value, unit * sigma[i], sigma[i] < 0.5 * kPriorSigma[i]};
  };
  result.is_calibrated = true;
  result.options = withParameters(nominal, parameters);
  result.scale = parameter(0, parameters[0], 1.0);
  result.right_over_left = parameter(1, (1.0 + 0.5 * parameters[1]) / (1.0 - 0.5 * parameters[1]), 1.0);
  result.track_width_m = parameter(2, result.options.track_width_m, nominal.track_width_m);
  return result;
}

Trajectory posesFromPositions(const std::vector<StampedPosition>& positions, double reach_m) {
  constexpr size_t kMinBeside = 3;  // positions before and behind that a cubic needs
  std::vector<double> travelled_m;
  for (size_t i = 0; i < positions.size(); ++i) {
    travelled_m.push_back(i == 0 ? 0.0
                                 : travelled_m.back() + std::hypot(positions[i].x_m - positions[i - 1].x_m,
                                                                   positions[i].y_m - positions[i - 1].y_m));
  }
  Trajectory trajectory;
  for (size_t i = kMinBeside; i + kMinBeside < positions.size(); ++i) {
    if (travelled_m[i] < reach_m || travelled_m.back() - travelled_m[i] < reach_m) {
      continue;
    }
    size_t first = i - kMinBeside;
    size_t last = i + kMinBeside;
    while (travelled_m[i] - travelled_m[first] < reach_m) {
      --first;
    }
    while (travelled_m[last] - travelled_m[i] < reach_m) {
      ++last;
    }
    const auto count = static_cast<int>(last - first + 1);
    const double span_m = travelled_m[last] - travelled_m[first];
    Eigen::MatrixX4d powers(count, 4);
    Eigen::MatrixX2d points(count, 2);
    for (int row = 0; row < count; ++row) {
      const size_t at = first + static_cast<size_t>(row);
      const double along = (travelled_m[at] - travelled_m[i]) / span_m;
      powers.row(row) << 1.0, along, along * along, along * along * along;
      points.row(row) << positions[at].x_m - positions[i].x_m, positions[at].y_m - positions[i].y_m;
    }
    const Eigen::Matrix<double, 4, 2> cubic = powers.colPivHouseholderQr().solve(points);
    trajectory.push_back({positions[i].stamp, RigidTransform::planar(positions[i].x_m, positions[i].y_m,
                                                                     std::atan2(cubic(1, 1), cubic(1, 0)))});
  }
  return trajectory;
}

}  // namespace vcharge
