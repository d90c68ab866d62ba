#include "vcharge_calibration/live/calibration_coach.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <utility>

#include <tbb/parallel_for.h>

#include "rig/rig_judgement.h"
#include "vcharge_core/base/error.h"
#include "vcharge_core/base/text_format.h"

namespace vcharge {
namespace {

constexpr double kDegrees = 57.29577951308232;
constexpr double kNaN = std::numeric_limits<double>::quiet_NaN();
constexpr int kHeight = 2;
// Of reweighting: a prediction needs not all of them.
constexpr int kMaxIterations = 10;

using Vector6d = Eigen::Matrix<double, 6, 1>;

/// As the formula has it; hand-eye gives one figure for x and y, and one for roll and pitch.
Vector6d formulaSigma(const HandEye& hand_eye) {
  Vector6d sigma;
  sigma << hand_eye.place_sigma_m, hand_eye.place_sigma_m, kNaN, hand_eye.tilt_sigma_rad,
      hand_eye.tilt_sigma_rad, hand_eye.yaw_sigma_rad;
  return sigma;
}

/// [dt, dphi] that moves `from` to `to`.
Vector6d differenceOf(const RigidTransform& from, const RigidTransform& to) {
  Vector6d difference;
  difference << to.translation() - from.translation(),
      vectorFromRotation(to.rotation() * from.rotation().conjugate());
  return difference;
}

/// An amount for people: full tens of degrees, never none.
std::string tensOfDegrees(double angle_rad) {
  return toText(10.0 * std::max(1.0, std::ceil(kDegrees * angle_rad / 10.0 - 1e-9)), 0);
}

/// Where a place lies, seen from the vehicle.
std::string directionTo(const RigidTransform& odom_from_vehicle, const RigidTransform& odom_from_place) {
  const Eigen::Vector3d there = odom_from_vehicle.inverse() * odom_from_place.translation();
  const double angle = std::atan2(there.y(), there.x());
  const char* where = std::abs(angle) < 0.8   ? "ahead"
                      : std::abs(angle) > 2.4 ? "behind"
                      : angle > 0.0           ? "to the left"
                                              : "to the right";
  return toText(there.head<2>().norm(), 0) + " m away, " + where;
}

}  // namespace

void CalibrationCoachOptions::validate() const {
  requireField(enough_distance_m > 0.0, "enough_distance_m", "must be positive", enough_distance_m);
  requireField(enough_turn_rad > 0.0, "enough_turn_rad", "must be positive", enough_turn_rad);
  requireField(enough_revisited_m >= 0.0, "enough_revisited_m", "must not be negative", enough_revisited_m);
  requireField(revisit_radius_m > 0.0, "revisit_radius_m", "must be positive", revisit_radius_m);
  requireField(revisit_gap_m > 2.0 * revisit_radius_m, "revisit_gap_m",
               "must be more than twice revisit_radius_m", revisit_gap_m);
  requireField(enough_sigma_m > 0.0, "enough_sigma_m", "must be positive", enough_sigma_m);
  requireField(enough_sigma_rad > 0.0, "enough_sigma_rad", "must be positive", enough_sigma_rad);
  requireField(min_seen_share >= 0.0 && min_seen_share <= 1.0, "min_seen_share", "must be within 0 and 1",
               min_seen_share);
  requireField(min_steps >= 1, "min_steps", "must be 1 or more", min_steps);
  requireField(segment_m > 0.0, "segment_m", "must be positive", segment_m);
  requireField(num_groups >= 4, "num_groups", "must be 4 or more", num_groups);
}

CalibrationCoach::CalibrationCoach(const std::vector<std::string>& camera_names,
                                   const HandEyeOptions& hand_eye, const CalibrationCoachOptions& options)
    : names_(camera_names), hand_eye_(hand_eye), options_(options), motions_(camera_names.size()) {
  options_.validate();
  hand_eye_.validate();
  hand_eye_.num_iterations = std::min(hand_eye_.num_iterations, kMaxIterations);
}

void CalibrationCoach::addKeyframe(const RigidTransform& odom_from_vehicle, double travelled_m) {
  Place place{odom_from_vehicle, travelled_m, false};
  for (const Place& earlier : places_) {
    if (travelled_m - earlier.travelled_m < options_.revisit_gap_m) {
      break;  // later ones are nearer still
    }
    const Eigen::Vector3d way = earlier.odom_from_vehicle.translation() - odom_from_vehicle.translation();
    place.is_revisited = place.is_revisited || way.head<2>().norm() < options_.revisit_radius_m;
  }
  if (!places_.empty()) {
    const Place& last = places_.back();
    const double turn_rad =
        yawOfRotation(last.odom_from_vehicle.rotation().conjugate() * odom_from_vehicle.rotation());
    (turn_rad > 0.0 ? left_turn_rad_ : right_turn_rad_) += std::abs(turn_rad);
    revisited_m_ += place.is_revisited ? travelled_m - last.travelled_m : 0.0;
  }
  places_.push_back(place);
}

void CalibrationCoach::addMotion(size_t camera, const MotionPair& motion) {
  check(camera < motions_.size() && motion.keyframe >= 0 &&
            static_cast<size_t>(motion.keyframe) < places_.size(),
        "CalibrationCoach::addMotion: expected a camera and a keyframe that were added");
  motions_[camera].push_back(motion);
}

CameraOutlook CalibrationCoach::cameraOutlook(size_t camera) const {
  const std::vector<MotionPair>& motions = motions_[camera];
  CameraOutlook outlook;
  outlook.name = names_[camera];
  outlook.hand_eye = solvePlanarHandEye(motions, hand_eye_);
  outlook.sigma = Vector6d::Constant(kNaN);
  if (outlook.hand_eye.status != HandEyeStatus::kOk) {
    return outlook;
  }
  outlook.sigma = formulaSigma(outlook.hand_eye);
  Vector6d squares = Vector6d::Zero();
  for (int group = 0; group < options_.num_groups; ++group) {
    std::vector<MotionPair> others;
    for (const MotionPair& motion : motions) {
      const double travelled_m = places_[static_cast<size_t>(motion.keyframe)].travelled_m;
      if (static_cast<int64_t>(travelled_m / options_.segment_m) % options_.num_groups != group) {
        others.push_back(motion);
      }
    }
    const HandEye without = solvePlanarHandEye(others, hand_eye_);
    if (without.status != HandEyeStatus::kOk) {
      outlook.sigma.setConstant(kNaN);  // it hangs on one part of the drive
      return outlook;
    }
    squares += differenceOf(outlook.hand_eye.vehicle_from_camera, without.vehicle_from_camera).cwiseAbs2();
  }
  // The jackknife's variance, times that of Student's t: so few groups know it badly themselves.
  const double groups = options_.num_groups;
  const double factor = (groups - 1.0) / groups * (groups - 1.0) / (groups - 3.0);
  outlook.sigma = outlook.sigma.cwiseMax((factor * squares).cwiseSqrt());
  outlook.sigma[kHeight] = kNaN;
  return outlook;
}

DriveOutlook CalibrationCoach::outlook() const {
  DriveOutlook outlook;
  outlook.distance_m = places_.empty() ? 0.0 : places_.back().travelled_m;
  outlook.left_turn_rad = left_turn_rad_;
  outlook.right_turn_rad = right_turn_rad_;
  outlook.revisited_m = revisited_m_;
  outlook.cameras.resize(names_.size());
  tbb::parallel_for(size_t{0}, names_.size(), [&](size_t i) { outlook.cameras[i] = cameraOutlook(i); });
  judge(&outlook);
  return outlook;
}

/// What is known least of a camera, in units of what is enough; infinite where nothing is known.
double CalibrationCoach::weakness(const CameraOutlook& camera, int* degree_of_freedom) const {
  double worst = 0.0;
  for (int i = 0; i < 6; ++i) {
    const double enough = i < 3 ? options_.enough_sigma_m : options_.enough_sigma_rad;
    const double share = i == kHeight                     ? 0.0
                         : std::isfinite(camera.sigma[i]) ? camera.sigma[i] / enough
                                                          : std::numeric_limits<double>::infinity();
    if (share > worst) {
      worst = share;
      *degree_of_freedom = i;
    }
  }
  return worst;
}

void CalibrationCoach::judgeSigmas(DriveOutlook* outlook, std::vector<double>* shares) const {
  const char* const names[] = {"forwards", "sideways", "height", "roll", "pitch", "yaw"};
  const CameraOutlook* weakest = nullptr;
  double most = 1.0;
  int what = 0;
  for (CameraOutlook& camera : outlook->cameras) {
    int degree_of_freedom = 0;
    const double weak = weakness(camera, &degree_of_freedom);
    camera.is_enough = weak <= 1.0;
    shares->push_back(1.0 / std::max(1.0, weak * weak));
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
           ? "the place of " + who + " cannot be told yet"
           : who + ", " + names[what] + ", is known to " +
                 (what < 3 ? toText(100.0 * sigma, 0) + " cm" : toText(kDegrees * sigma, 1) + " degrees") +
                 " only"));
}

/// Cameras that do not see come first, since no manoeuvre helps; then turns, way, places, and what is weak.
void CalibrationCoach::judge(DriveOutlook* outlook) const {
  std::vector<std::string>& missing = outlook->missing;
  std::vector<double> shares{outlook->distance_m / options_.enough_distance_m,
                             left_turn_rad_ / options_.enough_turn_rad,
                             right_turn_rad_ / options_.enough_turn_rad};
  const int num_steps = static_cast<int>(places_.size()) - 1;
  RigCalibration drive;
  drive.num_keyframes = num_steps + 1;
  for (const CameraOutlook& camera : outlook->cameras) {
    HandEye hand_eye = camera.hand_eye;
    if (num_steps >= options_.min_steps && hand_eye.num_motions < options_.min_seen_share * num_steps) {
      hand_eye.status = HandEyeStatus::kTooFewMotions;
    } else if (hand_eye.status != HandEyeStatus::kNoAgreement) {
      continue;
    }
    missing.push_back(describeFailure(camera.name, hand_eye, drive));
    shares.push_back(0.0);
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
    missing.push_back("come past a place again" +
                      (places_.empty()
                           ? ""
                           : ": where the drive began is " + directionTo(places_.back().odom_from_vehicle,
                                                                         places_.front().odom_from_vehicle)));
    shares.push_back(revisited_m_ / options_.enough_revisited_m);
  }
  judgeSigmas(outlook, &shares);
  outlook->progress = std::clamp(*std::min_element(shares.begin(), shares.end()), 0.0, 1.0);
  outlook->next = missing.empty() ? "you can stop now" : missing.front();
}

}  // namespace vcharge
