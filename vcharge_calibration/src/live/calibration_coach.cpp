#include "vcharge_calibration/live/calibration_coach.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <utility>

#include <tbb/parallel_for.h>

#include "rig/rig_judgement.h"
#include "vcharge_core/base/error.h"
#include "vcharge_core/base/text_format.h"
#include "vcharge_core/motion/pose_step.h"

namespace vcharge {
namespace {

/// A revisit is closer than this radius to an earlier part, with at least the gap driven in between.
constexpr double kRevisitRadius_m = 4.0;
constexpr double kRevisitGap_m = 25.0;
/// Minimum ratio of steps in which the motion of a camera must be known.
constexpr double kMinSeenRatio = 0.3;
/// Jackknife: length of parts with independent errors, and number of groups of parts, each left out once.
constexpr double kSegment_m = 5.0;
constexpr int kNumGroups = 10;

constexpr double kDegrees = 57.29577951308232;
constexpr double kNaN = std::numeric_limits<double>::quiet_NaN();
constexpr int kHeight = 2;
/// Iterations of hand-eye calibration: fewer suffice for a prediction.
constexpr int kHandEyeIterations = 10;

using Vector6d = Eigen::Matrix<double, 6, 1>;

/// Standard deviations from the formula of hand-eye calibration: one for x and y, one for roll and pitch.
Vector6d formulaSigma(const HandEye& hand_eye) {
  Vector6d sigma;
  sigma << hand_eye.position_sigma_m, hand_eye.position_sigma_m, kNaN, hand_eye.tilt_sigma_rad,
      hand_eye.tilt_sigma_rad, hand_eye.yaw_sigma_rad;
  return sigma;
}

/// Text of an angle, rounded up to tens of degrees.
std::string tensOfDegrees(double angle_rad) {
  return toText(10.0 * std::max(1.0, std::ceil(kDegrees * angle_rad / 10.0 - 1e-9)), 0);
}

/// Text of the direction from the vehicle to an earlier pose.
std::string directionTo(const RigidTransform& odom_from_vehicle, const RigidTransform& odom_from_earlier) {
  const Eigen::Vector3d there = odom_from_vehicle.inverse() * odom_from_earlier.translation();
  const double angle = std::atan2(there.y(), there.x());
  const char* where = std::abs(angle) < 0.8   ? "ahead"
                      : std::abs(angle) > 2.4 ? "behind"
                      : angle > 0.0           ? "to the left"
                                              : "to the right";
  return toText(there.head<2>().norm(), 0) + " m away, " + where;
}

}  // namespace

CalibrationCoach::CalibrationCoach(const std::vector<std::string>& camera_names,
                                   const HandEyeOptions& hand_eye, const CalibrationCoachOptions& options)
    : names_(camera_names), hand_eye_(hand_eye), options_(options), motions_(camera_names.size()) {
  options_.validate();
  hand_eye_.validate();
}

void CalibrationCoach::addKeyframe(const RigidTransform& odom_from_vehicle, double travelled_m) {
  VisitedPose current{odom_from_vehicle, travelled_m, false};
  for (const VisitedPose& earlier : visited_) {
    if (travelled_m - earlier.travelled_m < kRevisitGap_m) {
      break;  // later parts are too recent as well
    }
    const Eigen::Vector3d way = earlier.odom_from_vehicle.translation() - odom_from_vehicle.translation();
    current.is_revisited = current.is_revisited || way.head<2>().norm() < kRevisitRadius_m;
  }
  if (!visited_.empty()) {
    const VisitedPose& last = visited_.back();
    const double turn_rad =
        yawOfRotation(last.odom_from_vehicle.rotation().conjugate() * odom_from_vehicle.rotation());
    (turn_rad > 0.0 ? left_turn_rad_ : right_turn_rad_) += std::abs(turn_rad);
    revisited_m_ += current.is_revisited ? travelled_m - last.travelled_m : 0.0;
  }
  visited_.push_back(current);
}

void CalibrationCoach::addMotion(size_t camera, const MotionPair& motion) {
  check(camera < motions_.size() && motion.keyframe >= 0 &&
            static_cast<size_t>(motion.keyframe) < visited_.size(),
        "CalibrationCoach::addMotion: expected a camera and a keyframe that were added");
  motions_[camera].push_back(motion);
}

CameraOutlook CalibrationCoach::cameraOutlook(size_t camera) const {
  const std::vector<MotionPair>& motions = motions_[camera];
  CameraOutlook outlook;
  outlook.name = names_[camera];
  outlook.hand_eye = solvePlanarHandEye(motions, hand_eye_, kHandEyeIterations);
  outlook.sigma = Vector6d::Constant(kNaN);
  if (outlook.hand_eye.status != HandEyeStatus::kOk) {
    return outlook;
  }
  outlook.sigma = formulaSigma(outlook.hand_eye);
  Vector6d squares = Vector6d::Zero();
  for (int group = 0; group < kNumGroups; ++group) {
    std::vector<MotionPair> others;
    for (const MotionPair& motion : motions) {
      const double travelled_m = visited_[static_cast<size_t>(motion.keyframe)].travelled_m;
      if (static_cast<int64_t>(travelled_m / kSegment_m) % kNumGroups != group) {
        others.push_back(motion);
      }
    }
    const HandEye without = solvePlanarHandEye(others, hand_eye_, kHandEyeIterations);
    if (without.status != HandEyeStatus::kOk) {
      outlook.sigma.setConstant(kNaN);  // a single part of the drive determines the result
      return outlook;
    }
    squares += stepBetween(outlook.hand_eye.vehicle_from_camera, without.vehicle_from_camera).cwiseAbs2();
  }
  // Variance of the jackknife times that of Student's t distribution, since there are few groups.
  const double groups = kNumGroups;
  const double factor = (groups - 1.0) / groups * (groups - 1.0) / (groups - 3.0);
  outlook.sigma = outlook.sigma.cwiseMax((factor * squares).cwiseSqrt());
  outlook.sigma[kHeight] = kNaN;
  return outlook;
}

DriveOutlook CalibrationCoach::outlook() const {
  DriveOutlook outlook;
  outlook.distance_m = visited_.empty() ? 0.0 : visited_.back().travelled_m;
  outlook.left_turn_rad = left_turn_rad_;
  outlook.right_turn_rad = right_turn_rad_;
  outlook.revisited_m = revisited_m_;
  outlook.cameras.resize(names_.size());
  tbb::parallel_for(size_t{0}, names_.size(), [&](size_t i) { outlook.cameras[i] = cameraOutlook(i); });
  judge(&outlook);
  return outlook;
}

/// Largest ratio of a camera's standard deviation to the sufficient one; infinite while unknown.
double CalibrationCoach::weakness(const CameraOutlook& camera, int* degree_of_freedom) const {
  double worst = 0.0;
  for (int i = 0; i < 6; ++i) {
    const double enough = i < 3 ? options_.enough_sigma_m : options_.enough_sigma_rad;
    const double ratio = i == kHeight                     ? 0.0
                         : std::isfinite(camera.sigma[i]) ? camera.sigma[i] / enough
                                                          : std::numeric_limits<double>::infinity();
    if (ratio > worst) {
      worst = ratio;
      *degree_of_freedom = i;
    }
  }
  return worst;
}

void CalibrationCoach::judgeSigmas(DriveOutlook* outlook, std::vector<double>* fulfilled) const {
  const char* const names[] = {"forwards", "sideways", "height", "roll", "pitch", "yaw"};
  const CameraOutlook* weakest = nullptr;
  double most = 1.0;
  int what = 0;
  for (CameraOutlook& camera : outlook->cameras) {
    int degree_of_freedom = 0;
    const double weak = weakness(camera, &degree_of_freedom);
    camera.is_enough = weak <= 1.0;
    fulfilled->push_back(1.0 / std::max(1.0, weak * weak));
    if (weak > most) {
      most = weak;
      weakest = &camera;
      what = degree_of_freedom;
    }
  }
  if (weakest == nullptr) {
    return;
  }
  const double sigma = weakest->sigma[what];
  const std::string who = "camera '" + weakest->name + "'";
  outlook->missing.push_back(
      "turn tightly to both sides: " +
      (!std::isfinite(sigma)
           ? "the position of " + who + " is still unknown"
           : who + ", " + names[what] + ", is known only to " +
                 (what < 3 ? toText(100.0 * sigma, 0) + " cm" : toText(kDegrees * sigma, 1) + " degrees")));
}

/// Requirements in order of importance: blind cameras, which no manoeuvre helps, then turns, distance,
/// revisits, and uncertain cameras.
void CalibrationCoach::judge(DriveOutlook* outlook) const {
  std::vector<std::string>& missing = outlook->missing;
  std::vector<double> fulfilled{outlook->distance_m / options_.enough_distance_m,
                                left_turn_rad_ / options_.enough_turn_rad,
                                right_turn_rad_ / options_.enough_turn_rad};
  const int num_steps = static_cast<int>(visited_.size()) - 1;
  RigCalibration drive;
  drive.num_keyframes = num_steps + 1;
  for (const CameraOutlook& camera : outlook->cameras) {
    HandEye hand_eye = camera.hand_eye;
    if (num_steps >= options_.min_steps && hand_eye.num_motions < kMinSeenRatio * num_steps) {
      hand_eye.status = HandEyeStatus::kTooFewMotions;
    } else if (hand_eye.status != HandEyeStatus::kNoAgreement) {
      continue;
    }
    missing.push_back(describeFailure(camera.name, hand_eye, drive));
    fulfilled.push_back(0.0);
  }
  std::pair<double, const char*> turns[] = {{left_turn_rad_, "left"}, {right_turn_rad_, "right"}};
  if (right_turn_rad_ < left_turn_rad_) {
    std::swap(turns[0], turns[1]);
  }
  for (const auto& [turned_rad, side] : turns) {
    if (turned_rad < options_.enough_turn_rad) {
      missing.push_back(std::string("turn ") + side + ", " +
                        tensOfDegrees(options_.enough_turn_rad - turned_rad) + " degrees more");
    }
  }
  if (outlook->distance_m < options_.enough_distance_m) {
    missing.push_back("drive on, " + toText(std::ceil(options_.enough_distance_m - outlook->distance_m), 0) +
                      " m more");
  }
  if (revisited_m_ < options_.enough_revisited_m) {
    missing.push_back("revisit a place" + (visited_.empty()
                                               ? ""
                                               : ": the start of the drive is " +
                                                     directionTo(visited_.back().odom_from_vehicle,
                                                                 visited_.front().odom_from_vehicle)));
    fulfilled.push_back(revisited_m_ / options_.enough_revisited_m);
  }
  judgeSigmas(outlook, &fulfilled);
  outlook->progress = std::clamp(*std::min_element(fulfilled.begin(), fulfilled.end()), 0.0, 1.0);
  outlook->next = missing.empty() ? "you can stop now" : missing.front();
}

}  // namespace vcharge
