#include "vcharge_localization/drive_localizer.h"

#include <cmath>
#include <limits>
#include <utility>

#include "vcharge_core/base/error.h"
#include "vcharge_core/base/stage_timer.h"

namespace vcharge {
namespace {

// A relocalization is accepted when two frames agree within these bounds.
constexpr double kConfirmation_m = 0.3;
constexpr double kConfirmation_rad = 0.03;
constexpr double kMaxConfirmation_s = 1.0;
// Additional uncertainty of motion without odometry, which assumes a constant velocity.
constexpr double kUnknownMotion_m_per_s = 1.0;
constexpr double kUnknownTurn_rad_per_s = 0.3;
/// Tiles of the map are read before the vehicle is this close to where they are needed.
constexpr double kLookAhead_m = 10.0;

double squared(double value) {
  return value * value;
}

}  // namespace

DriveLocalizer::DriveLocalizer(std::shared_ptr<const TiledMap> map, std::shared_ptr<const CameraRig> rig,
                               const DriveLocalizerOptions& options)
    : rig_(std::move(rig)),
      options_((options.validate(), options)),
      localizer_(std::move(map), rig_, options.localizer),
      filter_(optionsForMapOf(localizer_.map()->rig(), options.filter)),
      health_(rig_, options.health) {}

void DriveLocalizer::seed(const PosePrior& pose) {
  filter_.reset(pose);
  is_seed_ = true;
  candidate_.reset();
  frames_without_fix_ = 0;
}

void DriveLocalizer::predict(const ImageFrame& frame) {
  // After a fix the pose no longer has the error of the last odometry; without one the next motion cancels
  // it.
  const CorrectedPose* corrected = last_stamp_ ? correctionAt(frame.corrections, *last_stamp_) : nullptr;
  if (corrected != nullptr && last_fix_ == last_stamp_) {
    last_odom_from_vehicle_ = corrected->odom_from_vehicle;
  }
  const double period_s = last_stamp_ ? toSeconds(frame.stamp - *last_stamp_) : 0.0;
  const bool is_counted = last_odom_from_vehicle_ && frame.odom_from_vehicle && period_s > 0.0 &&
                          frame.num_resets == last_num_resets_;
  if (is_counted) {
    last_motion_ = last_odom_from_vehicle_->inverse() * *frame.odom_from_vehicle;
    last_period_s_ = period_s;
    filter_.predict(last_motion_, period_s);
  } else if (period_s > 0.0) {
    // Without odometry, the vehicle is assumed to keep its velocity.
    const double ratio = last_period_s_ > 0.0 ? period_s / last_period_s_ : 0.0;
    if (ratio > 0.0 && ratio < 10.0) {
      filter_.predict(interpolate(RigidTransform(), last_motion_, ratio), period_s);
    }
    filter_.addNoise(kUnknownMotion_m_per_s * period_s, kUnknownTurn_rad_per_s * period_s);
  } else if (period_s < 0.0) {
    forget();  // the drive is replayed
  }
  last_stamp_ = frame.stamp;
  last_num_resets_ = frame.num_resets;
  last_odom_from_vehicle_ = frame.odom_from_vehicle;
}

bool DriveLocalizer::isLost() const {
  if (!filter_.hasPose()) {
    return true;
  }
  if (is_seed_) {
    return false;  // even if uncertain: the next frames search around this pose
  }
  const Eigen::Matrix<double, 6, 6> covariance = filter_.pose().covariance;
  return covariance.topLeftCorner<3, 3>().trace() > options_.lost_sigma_m * options_.lost_sigma_m ||
         covariance.bottomRightCorner<3, 3>().trace() > options_.lost_sigma_rad * options_.lost_sigma_rad;
}

void DriveLocalizer::takeFix(const PoseFix& fix, LocalizationResult* result) {
  result->status = LocalizationStatus::kLocalized;
  result->fix = fix;
  frames_without_fix_ = 0;
  is_seed_ = false;
  candidate_.reset();
  last_fix_ = result->stamp;
}

void DriveLocalizer::track(const RigFeatures& features, LocalizationResult* result) {
  result->status = LocalizationStatus::kBridgedByOdometry;
  result->fix = localizer_.localizeNear(features, filter_.pose());
  if (result->fix.status == LocalizationStatus::kLocalized) {
    health_.addFix(result->fix);
    result->fix_distance = filter_.distanceOf(result->fix);
    if (filter_.update(result->fix)) {
      takeFix(result->fix, result);
      return;
    }
    result->message = "the images contradict the predicted pose";
  } else {
    result->message = result->fix.status == LocalizationStatus::kTooFewMatches
                          ? "too few landmarks found in the images"
                          : "no pose explains enough of the matches";
  }
  ++frames_without_fix_;
}

std::optional<RigidTransform> DriveLocalizer::candidateNow(const ImageFrame& frame) const {
  if (!candidate_ || toSeconds(frame.stamp - candidate_->stamp) > kMaxConfirmation_s) {
    return std::nullopt;
  }
  RigidTransform moved;
  if (candidate_->odom_from_vehicle && frame.odom_from_vehicle) {
    moved = candidate_->odom_from_vehicle->inverse() * *frame.odom_from_vehicle;
  }
  return candidate_->map_from_vehicle * moved;
}

bool DriveLocalizer::isConfirmed(const RigidTransform& expected, const PoseFix& fix) const {
  const RigidTransform difference = expected.inverse() * fix.map_from_vehicle;
  return fix.status == LocalizationStatus::kLocalized && difference.translation().norm() <= kConfirmation_m &&
         angleOfRotation(difference.rotation()) <= kConfirmation_rad;
}

PoseFix DriveLocalizer::searchFrom(const std::optional<RigidTransform>& expected,
                                   const RigFeatures& features) const {
  if (expected) {
    PosePrior prior{*expected, Eigen::Matrix<double, 6, 6>::Zero()};
    prior.covariance.diagonal() << Eigen::Vector3d::Constant(squared(kConfirmation_m) / 9.0),
        Eigen::Vector3d::Constant(squared(kConfirmation_rad) / 9.0);
    const PoseFix fix = localizer_.localizeNear(features, prior);
    if (isConfirmed(*expected, fix) && fix.numInliers() >= localizer_.minInliersWithoutPrior(features)) {
      return fix;
    }
  }
  return localizer_.localizeAnywhere(features);
}

void DriveLocalizer::searchWholeMap(const ImageFrame& frame, const RigFeatures& features,
                                    LocalizationResult* result) {
  result->searched_whole_map = true;
  const std::optional<RigidTransform> expected = candidateNow(frame);
  const PoseFix fix = searchFrom(expected, features);
  const bool tracks = result->status == LocalizationStatus::kBridgedByOdometry;
  if (!tracks) {
    result->fix = fix;
    result->status = fix.status;
  }
  if (fix.status != LocalizationStatus::kLocalized) {
    if (!expected) {
      candidate_.reset();  // otherwise the next frame may confirm it
    }
    if (!tracks) {
      result->message = fix.status == LocalizationStatus::kAmbiguous ? "two places of the map look alike"
                                                                     : "no place of the map was recognized";
    }
    return;
  }
  if (tracks && filter_.update(fix)) {
    takeFix(fix, result);
  } else if (expected && isConfirmed(*expected, fix)) {
    filter_.reset({fix.map_from_vehicle, options_.filter.fix_covariance_factor * fix.covariance});
    takeFix(fix, result);
    result->message = "found in the map";
  } else {
    candidate_ = {frame.stamp, fix.map_from_vehicle, frame.odom_from_vehicle};
    if (!tracks) {
      result->status = LocalizationStatus::kLost;
    }
    result->message = "a place was recognized; the next frames must confirm it";
  }
}

void DriveLocalizer::forget() {
  filter_.forget();
  is_seed_ = false;
  candidate_.reset();
  last_fix_.reset();
  frames_without_fix_ = 0;
}

LocalizationResult DriveLocalizer::process(const ImageFrame& frame) {
  LocalizationResult result;
  RigFeatures features;
  {
    const StageTimer timer("features", &result.stage_s);
    features = localizer_.extract(health_.withoutFrozen(frame));
  }
  localize(frame, features, &result);
  return result;
}

LocalizationResult DriveLocalizer::process(const ImageFrame& frame, const RigFeatures& features) {
  LocalizationResult result;
  localize(frame, features, &result);
  return result;
}

void DriveLocalizer::localize(const ImageFrame& frame, const RigFeatures& features,
                              LocalizationResult* result) {
  result->stamp = frame.stamp;
  result->odom_from_vehicle = frame.odom_from_vehicle;
  health_.addFeatures(features);
  predict(frame);
  bool search_whole_map = isLost();
  if (search_whole_map) {
    filter_.forget();
  } else {
    const StageTimer timer("guided search", &result->stage_s);
    track(features, result);
    const bool is_stuck =
        frames_without_fix_ > 0 && frames_without_fix_ % options_.max_frames_without_fix == 0;
    search_whole_map = is_stuck || (frames_without_fix_ > 0 && candidate_);
    if (is_seed_) {
      result->status = LocalizationStatus::kLost;
      result->message = "the images do not confirm the given pose: " + result->message;
      if (is_stuck) {
        forget();
      }
    }
  }
  if (search_whole_map) {
    const StageTimer timer("whole map", &result->stage_s);
    searchWholeMap(frame, features, result);
  }
  if (filter_.hasPose() && !is_seed_) {
    result->pose = filter_.pose();
    localizer_.map()->prefetch(result->pose->map_from_vehicle.translation(),
                               options_.localizer.max_distance_m + kLookAhead_m);
  }
  result->since_fix_s =
      last_fix_ ? toSeconds(frame.stamp - *last_fix_) : std::numeric_limits<double>::infinity();
  result->camera_warnings = health_.warnings();
}

}  // namespace vcharge
