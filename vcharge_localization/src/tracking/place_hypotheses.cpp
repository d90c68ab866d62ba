#include "tracking/place_hypotheses.h"

#include <algorithm>

namespace vcharge {
namespace {

// A fix confirms an expected pose within these bounds.
constexpr double kConfirmation_m = 0.3;
constexpr double kConfirmation_rad = 0.03;
/// Places are forgotten after a longer gap between frames.
constexpr double kMaxGap_s = 1.0;
constexpr int kMaxMissed = 2;
constexpr size_t kMaxPlaces = 6;
/// Frames between searches of the whole map while several places fit.
constexpr int kSearchPeriod = 10;
/// Weight of the inliers of a frame relative to the next frame's.
constexpr double kMemory = 0.9;

double squared(double value) {
  return value * value;
}

bool isConfirmed(const RigidTransform& expected, const PoseFix& fix) {
  const RigidTransform difference = expected.inverse() * fix.map_from_vehicle;
  return fix.status == LocalizationStatus::kLocalized && difference.translation().norm() <= kConfirmation_m &&
         angleOfRotation(difference.rotation()) <= kConfirmation_rad;
}

}  // namespace

void PlaceHypotheses::Place::addFix(const PoseFix& found) {
  fix = found;
  map_from_vehicle = found.map_from_vehicle;
  sum_inliers = kMemory * sum_inliers + found.numInliers();
  sum_weights = kMemory * sum_weights + 1.0;
  ++num_frames;
  num_missed = 0;
}

void PlaceHypotheses::Place::addMiss() {
  sum_inliers *= kMemory;
  sum_weights = kMemory * sum_weights + 1.0;
  ++num_missed;
}

void PlaceHypotheses::moveTo(const ImageFrame& frame) {
  if (last_ && (toSeconds(frame.stamp - last_->stamp) > kMaxGap_s || frame.num_resets != last_->num_resets)) {
    places_.clear();
  }
  if (last_ && last_->odom_from_vehicle && frame.odom_from_vehicle) {
    const RigidTransform moved = last_->odom_from_vehicle->inverse() * *frame.odom_from_vehicle;
    for (Place& place : places_) {
      place.map_from_vehicle = place.map_from_vehicle * moved;
    }
  }
  last_ = {frame.stamp, frame.odom_from_vehicle, frame.num_resets};
}

void PlaceHypotheses::follow(const RigFeatures& features) {
  for (Place& place : places_) {
    PosePrior prior{place.map_from_vehicle, Eigen::Matrix<double, 6, 6>::Zero()};
    prior.covariance.diagonal() << Eigen::Vector3d::Constant(squared(kConfirmation_m / 3.0)),
        Eigen::Vector3d::Constant(squared(kConfirmation_rad / 3.0));
    const PoseFix fix = localizer_.localizeNear(features, prior);
    if (isConfirmed(place.map_from_vehicle, fix) &&
        fix.numInliers() >= localizer_.minInliersWithoutPrior(features)) {
      place.addFix(fix);
    } else {
      place.addMiss();
    }
  }
}

PoseFix PlaceHypotheses::search(const RigFeatures& features) {
  const std::vector<PoseFix> fixes = localizer_.localizeEverywhere(features);
  if (fixes.empty()) {
    return {};
  }
  if (fixes.front().status != LocalizationStatus::kLocalized) {
    return fixes.front();
  }
  for (const PoseFix& fix : fixes) {
    if (fix.numInliers() <= max_ambiguity_ * fixes.front().numInliers()) {
      continue;
    }
    const auto known = std::find_if(places_.begin(), places_.end(), [&](const Place& place) {
      return !localizer_.isOtherPlace(place.map_from_vehicle, fix.map_from_vehicle);
    });
    if (known == places_.end()) {
      places_.emplace_back().addFix(fix);
    } else if (known->num_missed > 0) {
      if (!isConfirmed(known->map_from_vehicle, fix)) {
        *known = Place();
      }
      known->addFix(fix);
    }
  }
  return fixes.front();
}

void PlaceHypotheses::dropBeaten() {
  const auto drop = [&](const auto& isDropped) {
    places_.erase(std::remove_if(places_.begin(), places_.end(), isDropped), places_.end());
  };
  drop([](const Place& place) { return place.num_missed > kMaxMissed; });
  std::stable_sort(places_.begin(), places_.end(),
                   [](const Place& a, const Place& b) { return a.inliers() > b.inliers(); });
  if (places_.empty()) {
    return;
  }
  const double most = places_.front().inliers();
  drop([&](const Place& place) { return place.inliers() <= max_ambiguity_ * most; });
  // Two places whose paths met are one.
  std::vector<Place> kept;
  for (const Place& place : places_) {
    if (kept.size() < kMaxPlaces && std::none_of(kept.begin(), kept.end(), [&](const Place& better) {
          return !localizer_.isOtherPlace(place.map_from_vehicle, better.map_from_vehicle);
        })) {
      kept.push_back(place);
    }
  }
  places_ = std::move(kept);
}

PlaceHypotheses::Result PlaceHypotheses::update(const ImageFrame& frame, const RigFeatures& features) {
  moveTo(frame);
  follow(features);
  const bool fits =
      std::any_of(places_.begin(), places_.end(), [](const Place& place) { return place.num_missed == 0; });
  Result result;
  if (!fits || (places_.size() > 1 && --frames_until_search_ <= 0)) {
    result.fix = search(features);
    frames_until_search_ = kSearchPeriod;
  }
  dropBeaten();
  result.num_places = static_cast<int>(places_.size());
  if (places_.empty()) {
    return result;
  }
  const Place& best = places_.front();
  result.fix = best.fix;
  if (places_.size() > 1) {
    result.fix.status = LocalizationStatus::kAmbiguous;
    result.fix.second_best_ratio = places_[1].inliers() / best.inliers();
  } else if (best.num_missed > 0) {
    result.fix.status = LocalizationStatus::kNoConsensus;
  } else {
    result.is_confirmed = best.num_frames >= 2;
  }
  return result;
}

}  // namespace vcharge
