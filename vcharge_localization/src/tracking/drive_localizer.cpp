#include "vcharge_localization/drive_localizer.h"

#include <cmath>
#include <limits>
#include <string>
#include <utility>

#include "tracking/place_hypotheses.h"
#include "vcharge_core/base/error.h"
#include "vcharge_core/base/stage_timer.h"

namespace vcharge {
namespace {

// Additional uncertainty of motion without odometry, which assumes a constant velocity.
constexpr double kUnknownMotion_m_per_s = 1.0;
constexpr double kUnknownTurn_rad_per_s = 0.3;
/// Tiles of the map are read before the vehicle is this close to where they are needed.
constexpr double kLookAhead_m = 10.0;
// Uncertainty of a pose that is carried to another version of the map.
constexpr double kVersionSigma_m = 0.1;
constexpr double kVersionSigma_rad = 0.01;

}  // namespace

DriveLocalizer::DriveLocalizer(std::shared_ptr<const TiledMap> map, std::shared_ptr<const CameraRig> rig,
                               const DriveLocalizerOptions& options)
    : rig_(std::move(rig)),
      options_((options.validate(), options)),
      localizer_(std::move(map), rig_, options.localizer),
      filter_(options.filter),
      health_(rig_, options.health),
      hypotheses_(std::make_unique<PlaceHypotheses>(localizer_, options.localizer.max_ambiguity)) {}

DriveLocalizer::~DriveLocalizer() = default;

void DriveLocalizer::seed(const PosePrior& pose) {
  filter_.reset(pose);
  is_seed_ = true;
  hypotheses_->clear();
  frames_without_fix_ = 0;
}

void DriveLocalizer::continueFrom(const DriveLocalizer& other) {
  if (!haveSameImages(*rig_, *other.rig_)) {
    throw InputError("rig: expected the cameras and image sizes of the rig in use");
  }
  if (other.filter_.hasPose() && !other.is_seed_) {
    PosePrior pose = other.filter_.prediction();
    pose.covariance.diagonal().head<3>().array() += kVersionSigma_m * kVersionSigma_m;
    pose.covariance.diagonal().tail<3>().array() += kVersionSigma_rad * kVersionSigma_rad;
    filter_ = other.filter_;
    seed(pose);
    last_stamp_ = other.last_stamp_;
    last_odom_from_vehicle_ = other.last_odom_from_vehicle_;
    last_num_resets_ = other.last_num_resets_;
    last_motion_ = other.last_motion_;
    last_period_s_ = other.last_period_s_;
  }
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
  const Eigen::Matrix<double, 6, 6> covariance = filter_.prediction().covariance;
  return covariance.topLeftCorner<3, 3>().trace() > options_.lost_sigma_m * options_.lost_sigma_m ||
         covariance.bottomRightCorner<3, 3>().trace() > options_.lost_sigma_rad * options_.lost_sigma_rad;
}

void DriveLocalizer::takeFix(const PoseFix& fix, LocalizationResult* result) {
  result->status = LocalizationStatus::kLocalized;
  result->fix = fix;
  frames_without_fix_ = 0;
  is_seed_ = false;
  hypotheses_->clear();
  last_fix_ = result->stamp;
}

void DriveLocalizer::track(const RigFeatures& features, LocalizationResult* result) {
  result->status = LocalizationStatus::kBridgedByOdometry;
  result->fix = localizer_.localizeNear(features, filter_.prediction());
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

void DriveLocalizer::searchWholeMap(const ImageFrame& frame, const RigFeatures& features,
                                    LocalizationResult* result) {
  result->searched_whole_map = true;
  const PlaceHypotheses::Result found = hypotheses_->update(frame, features);
  const bool tracks = result->status == LocalizationStatus::kBridgedByOdometry;
  if (!tracks) {
    result->fix = found.fix;
    result->status = found.fix.status;
  }
  if (found.fix.status != LocalizationStatus::kLocalized) {
    if (!tracks) {
      result->message = found.fix.status == LocalizationStatus::kAmbiguous
                            ? std::to_string(found.num_places) + " places of the map look alike"
                            : "no place of the map was recognized";
    }
  } else if (tracks && filter_.update(found.fix)) {
    takeFix(found.fix, result);
  } else if (found.is_confirmed) {
    filter_.reset(found.fix);
    takeFix(found.fix, result);
    result->message = "found in the map";
  } else {
    if (!tracks) {
      result->status = LocalizationStatus::kLost;
    }
    result->message = "a place was recognized; the next frames must confirm it";
  }
}

void DriveLocalizer::forget() {
  filter_.forget();
  is_seed_ = false;
  hypotheses_->clear();
  last_fix_.reset();
  frames_without_fix_ = 0;
}

LocalizationResult DriveLocalizer::process(const ImageFrame& frame) {
  LocalizationResult result;
  RigFeatures features;
  {
    const StageTimer timer("features", &result.stage_s);
    features = localizer_.extract(health_.usableImages(frame), frame.motion);
  }
  localize(frame, features, &result);
  return result;
}

LocalizationResult DriveLocalizer::process(const ImageFrame& frame, const RigFeatures& features) {
  LocalizationResult result;
  localize(frame, health_.usableFeatures(features), &result);
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
    search_whole_map = is_stuck || (frames_without_fix_ > 0 && !hypotheses_->isEmpty());
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
