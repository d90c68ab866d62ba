#include <algorithm>
#include <array>
#include <cmath>

#include "check/odometry_check.h"

namespace vcharge::internal {
namespace {

/// Image motion of a standing and of a moving vehicle.
constexpr double kStill_px = 0.4;
constexpr double kMoves_px = 1.5;
/// The same for the odometry.
constexpr double kStill_m = 0.005, kStill_rad = 0.0005;
constexpr double kMoves_m = 0.1;
/// Ratios instead of counts, since other cars may drive past.
constexpr double kManyContradict = 0.05, kTooManyContradict = 0.3;
constexpr size_t kMinMotions = 20;  // motions with a rotation
constexpr int kMinPairs = 5;        // fewer pairs give no finding

constexpr double kMaxOffset_s = 0.5, kOffsetStep_s = 0.005;
constexpr double kTrimmed = 0.2;
/// Drives with a smaller turn give no finding about turns.
constexpr double kMinTurn_rad = 0.3;
constexpr double kMaxOffsetSigma_s = 0.005;
constexpr double kOffset_s = 0.02, kLargeOffset_s = 0.05;
/// The same for one camera against all.
constexpr double kCameraOffset_s = 0.004, kLargeCameraOffset_s = 0.05, kCameraOffsetSigmas = 3.5;
/// Rotations from pairs of images have errors of some percent.
constexpr double kTurnError = 0.06, kLargeTurnError = 0.25;

constexpr double kMaxTurnOfStraight_rad = 2.0 * kDegree;
constexpr double kAxisError_deg = 10.0, kLargeAxisError_deg = 30.0;
constexpr double kMaxAxisSigma_rad = 3.0 * kDegree;
constexpr size_t kMinDirections = 10;
constexpr double kDirectionError_deg = 10.0, kLargeDirectionError_deg = 30.0;

/// A turn about the camera's vertical, from its images.
struct Turn {
  double begin_s, end_s, turn_rad;
};

/// A camera's motion and the odometry of the same time.
struct ComparedMotion {
  const ImageMotion* motion;
  double begin_s, end_s;  // times on the odometry's path
  double distance_m, turn_rad;
};

/// The motions that the path covers. `clock_offset_s`: as in ImageTiming.
std::vector<ComparedMotion> compareMotions(const OdometryPath& path, double clock_offset_s,
                                           const std::vector<ImageMotion>& motions) {
  std::vector<ComparedMotion> compared;
  for (const ImageMotion& motion : motions) {
    const double begin_s = path.secondsOf(motion.begin) + clock_offset_s;
    const double end_s = path.secondsOf(motion.end) + clock_offset_s;
    if (path.covers(begin_s) && path.covers(end_s)) {
      compared.push_back({&motion, begin_s, end_s, path.distance_m(end_s) - path.distance_m(begin_s),
                          path.yaw_rad(end_s) - path.yaw_rad(begin_s)});
    }
  }
  return compared;
}

/// Axis of the vehicle's turns in the camera's frame, upwards: the common axis of rotations that agree with
/// the odometry's turns. Nothing if the vehicle turns too little.
std::optional<Eigen::Vector3d> turnAxis(const std::vector<ComparedMotion>& motions) {
  Eigen::Vector3d sum = Eigen::Vector3d::Zero();
  double square = 0.0;
  for (const ComparedMotion& compared : motions) {
    if (compared.motion->rotation_rad) {
      sum += compared.turn_rad * *compared.motion->rotation_rad;
      square += compared.turn_rad * compared.turn_rad;
    }
  }
  if (square < kMinTurn_rad * kMinTurn_rad / kMinMotions || sum.norm() == 0.0) {
    return std::nullopt;
  }
  const Eigen::Vector3d axis = sum / square;
  std::vector<double> residuals_rad;
  for (const ComparedMotion& compared : motions) {
    if (compared.motion->rotation_rad) {
      residuals_rad.push_back((*compared.motion->rotation_rad - compared.turn_rad * axis).norm());
    }
  }
  if (residuals_rad.size() < kMinMotions ||
      quantile(residuals_rad, 0.7) / std::sqrt(square) > kMaxAxisSigma_rad * axis.norm()) {
    return std::nullopt;
  }
  // No camera is mounted upside down: y points down in its images.
  return (axis.y() < 0.0 ? axis : Eigen::Vector3d(-axis)).normalized();
}

struct TurnFit {
  double cost = 0.0;   // mean squared residual, without the worst ones
  double ratio = 0.0;  // odometry's turn over the images' turn
};

TurnFit fitTurns(const OdometryPath& path, const std::vector<Turn>& turns, double offset_s) {
  std::vector<std::array<double, 2>> pairs;  // turn from the images, turn from the odometry
  for (const Turn& turn : turns) {
    pairs.push_back(
        {turn.turn_rad, path.yaw_rad(turn.end_s + offset_s) - path.yaw_rad(turn.begin_s + offset_s)});
  }
  TurnFit fit;
  size_t num_kept = pairs.size();
  for (int round = 0; round < 4; ++round) {
    double product = 0.0, square = 0.0;
    for (size_t i = 0; i < num_kept; ++i) {
      product += pairs[i][0] * pairs[i][1];
      square += pairs[i][0] * pairs[i][0];
    }
    fit.ratio = square > 0.0 ? product / square : 0.0;
    const auto residual = [&](const std::array<double, 2>& pair) {
      return std::abs(pair[1] - fit.ratio * pair[0]);
    };
    std::sort(pairs.begin(), pairs.end(),
              [&](const auto& a, const auto& b) { return residual(a) < residual(b); });
    num_kept = pairs.size() - static_cast<size_t>(kTrimmed * static_cast<double>(pairs.size()));
    fit.cost = 0.0;
    for (size_t i = 0; i < num_kept; ++i) {
      fit.cost += residual(pairs[i]) * residual(pairs[i]) / static_cast<double>(num_kept);
    }
  }
  return fit;
}

/// Delay of the odometry's stamps behind the images', with standard deviation.
struct OffsetFit {
  double offset_s = 0.0, sigma_s = 1.0;
  TurnFit turns;
};

OffsetFit fitOffset(const OdometryPath& path, const std::vector<Turn>& turns) {
  const int num_steps = static_cast<int>(kMaxOffset_s / kOffsetStep_s);
  std::vector<TurnFit> fits;
  int best = 0;
  for (int step = -num_steps; step <= num_steps; ++step) {
    fits.push_back(fitTurns(path, turns, step * kOffsetStep_s));
    best = fits.back().cost < fits[static_cast<size_t>(best)].cost ? static_cast<int>(fits.size()) - 1 : best;
  }
  OffsetFit result;
  result.turns = fits[static_cast<size_t>(best)];
  result.offset_s = (best - num_steps) * kOffsetStep_s;
  if (best == 0 || best == 2 * num_steps) {
    return result;  // the best offset may lie outside the examined range
  }
  // A parabola through points that are far enough apart not to fit noise.
  const int reach = std::min({8, best, 2 * num_steps - best});
  const double before = fits[static_cast<size_t>(best - reach)].cost,
               after = fits[static_cast<size_t>(best + reach)].cost;
  const double curvature = (before + after - 2.0 * result.turns.cost) / std::pow(reach * kOffsetStep_s, 2);
  if (curvature > 0.0) {
    const double slope = (after - before) / (2.0 * reach * kOffsetStep_s);
    result.offset_s -= std::clamp(slope / curvature, -reach * kOffsetStep_s, reach * kOffsetStep_s);
    result.sigma_s = std::sqrt(2.0 * result.turns.cost / (static_cast<double>(turns.size()) * curvature));
  }
  return result;
}

void judgeStanding(const std::vector<std::vector<ComparedMotion>>& motions, CheckFindings* findings) {
  int64_t num = 0, num_only_images = 0, num_only_odometry = 0;
  for (const std::vector<ComparedMotion>& of_camera : motions) {
    for (const ComparedMotion& compared : of_camera) {
      const double distance_m = std::abs(compared.distance_m), turn_rad = std::abs(compared.turn_rad);
      const double flow_px = compared.motion->flow_px;
      ++num;
      num_only_images += flow_px > kMoves_px && distance_m < kStill_m && turn_rad < kStill_rad ? 1 : 0;
      num_only_odometry += flow_px < kStill_px && distance_m > kMoves_m ? 1 : 0;
    }
  }
  if (num < kMinPairs) {
    findings->add("images and odometry", CheckGrade::kWarn,
                  "too few corners can be followed from image to image to compare them");
    return;
  }
  const double images = static_cast<double>(num_only_images) / static_cast<double>(num);
  const double odometry = static_cast<double>(num_only_odometry) / static_cast<double>(num);
  findings->atMost("images and odometry: standing", std::max(images, odometry), kManyContradict,
                   kTooManyContradict,
                   "the images alone move in " + percentText(images) + ", the odometry alone in " +
                       percentText(odometry) + " of " + std::to_string(num) + " pairs of images",
                   images > odometry ? "does the odometry count, and is it of this drive?"
                                     : "do wheels spin, or do cameras hang?");
}

/// Do a camera's stamps agree with those of all?
void judgeClock(const std::string& name, const OffsetFit& camera, const OffsetFit& all,
                CheckFindings* findings) {
  // Stamps that are early make the odometry's look late.
  const double early_s = camera.offset_s - all.offset_s;
  if (camera.sigma_s < kMaxOffsetSigma_s) {
    findings->atMost(name + ": time", std::max(0.0, std::abs(early_s) - kCameraOffsetSigmas * camera.sigma_s),
                     kCameraOffset_s, kLargeCameraOffset_s,
                     "its stamps are " + toText(1e3 * early_s, 1) +
                         " ms early against those of all cameras (sigma " + toText(1e3 * camera.sigma_s, 1) +
                         " ms)",
                     "does rig.yaml tell its clock_offset_s?");
  }
}

void judgeTurns(const OdometryPath& path, const CameraRig& rig,
                const std::vector<std::vector<ComparedMotion>>& motions, CheckFindings* findings) {
  std::vector<Turn> turns;
  std::vector<std::vector<Turn>> turns_of_camera(motions.size());
  double sum_rad = 0.0;
  for (size_t camera = 0; camera < motions.size(); ++camera) {
    const std::optional<Eigen::Vector3d> axis = turnAxis(motions[camera]);
    if (!axis) {
      continue;
    }
    const RigCamera& of_rig = rig.cameras[camera];
    if (of_rig.vehicle_from_camera) {
      const Eigen::Vector3d up = of_rig.vehicle_from_camera->rotation().inverse() * Eigen::Vector3d::UnitZ();
      const double off_deg = std::acos(std::clamp(axis->dot(up), -1.0, 1.0)) / kDegree;
      findings->atMost(
          of_rig.name + ": vertical", off_deg, kAxisError_deg, kLargeAxisError_deg,
          "the axis of its turns lies " + toText(off_deg, 1) + " degrees from rig.yaml's vertical",
          "is it mounted as rig.yaml says?");
    }
    for (const ComparedMotion& compared : motions[camera]) {
      if (compared.motion->rotation_rad) {
        turns.push_back({compared.begin_s, compared.end_s, axis->dot(*compared.motion->rotation_rad)});
        turns_of_camera[camera].push_back(turns.back());
        sum_rad += std::abs(turns.back().turn_rad);
      }
    }
  }
  if (turns.size() < kMinMotions || sum_rad < kMinTurn_rad) {
    return;
  }
  const OffsetFit fit = fitOffset(path, turns);
  const double error = fit.turns.ratio - 1.0;
  const std::string figure = "the odometry turns by " + toText(fit.turns.ratio, 3) +
                             " of what the images say (" + std::to_string(turns.size()) + " pairs)";
  if (fit.turns.ratio < 0.0) {
    findings->add("images and odometry: turns", CheckGrade::kFail,
                  figure + ": left and right swapped, wheels' or steering's?");
  } else {
    findings->atMost("images and odometry: turns", std::abs(error), kTurnError, kLargeTurnError, figure,
                     "wrong track width or wheel radii, slip, or wrong intrinsics?");
  }
  if (fit.sigma_s < kMaxOffsetSigma_s) {
    findings->atMost("images and odometry: time", std::max(0.0, std::abs(fit.offset_s) - 3.0 * fit.sigma_s),
                     kOffset_s, kLargeOffset_s,
                     "the odometry's stamps are " + toText(1e3 * fit.offset_s, 1) +
                         " ms late against the images' (sigma " + toText(1e3 * fit.sigma_s, 1) + " ms)",
                     "stamps taken at arrival, or of another clock?");
  }
  for (size_t camera = 0; camera < motions.size(); ++camera) {
    if (turns_of_camera[camera].size() >= kMinMotions) {
      judgeClock(rig.cameras[camera].name, fitOffset(path, turns_of_camera[camera]), fit, findings);
    }
  }
}

/// Straight motion with known extrinsics: does each camera move in the direction that the odometry predicts?
void judgeDirections(const CameraRig& rig, const std::vector<std::vector<ComparedMotion>>& motions,
                     CheckFindings* findings) {
  for (size_t camera = 0; camera < motions.size(); ++camera) {
    const RigCamera& of_rig = rig.cameras[camera];
    if (!of_rig.vehicle_from_camera) {
      continue;
    }
    std::vector<double> errors_deg;
    for (const ComparedMotion& compared : motions[camera]) {
      if (!compared.motion->rotation_rad || std::abs(compared.distance_m) < kMoves_m ||
          std::abs(compared.turn_rad) > kMaxTurnOfStraight_rad) {
        continue;
      }
      const Eigen::Vector3d expected = of_rig.vehicle_from_camera->rotation().inverse() *
                                       Eigen::Vector3d(compared.distance_m > 0.0 ? 1.0 : -1.0, 0.0, 0.0);
      errors_deg.push_back(std::acos(std::clamp(expected.dot(compared.motion->direction), -1.0, 1.0)) /
                           kDegree);
    }
    if (errors_deg.size() < kMinDirections) {
      continue;
    }
    // Single directions may be far off; a wrong rig or odometry shifts all of them.
    const double usual_deg = quantile(errors_deg, 0.5), best_deg = quantile(errors_deg, 0.2);
    const std::string figure = "moves " + toText(usual_deg, 1) +
                               " degrees beside where odometry and rig.yaml say (median of " +
                               std::to_string(errors_deg.size()) + ")";
    findings->atMost(of_rig.name + ": direction", best_deg, kDirectionError_deg, kLargeDirectionError_deg,
                     figure, "swapped plugs, a bumped camera, or odometry that counts backwards?");
  }
}

}  // namespace

void judgeAgreement(const OdometryPath& path, const CameraRig& rig,
                    const std::vector<std::vector<ImageMotion>>& motions, CheckFindings* findings) {
  std::vector<std::vector<ComparedMotion>> compared;
  for (size_t camera = 0; camera < motions.size(); ++camera) {
    compared.push_back(compareMotions(path, rig.cameras[camera].timing.clock_offset_s, motions[camera]));
  }
  judgeStanding(compared, findings);
  judgeTurns(path, rig, compared, findings);
  judgeDirections(rig, compared, findings);
}

}  // namespace vcharge::internal
