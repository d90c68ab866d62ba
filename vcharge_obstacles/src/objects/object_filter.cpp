#include "objects/object_filter.h"

#include <algorithm>
#include <cmath>
#include <tuple>

#include <Eigen/Cholesky>

namespace vcharge {
namespace {

// Standard deviation of the acceleration, in a second: a person walks on at much the same speed.
constexpr double kAcceleration_m_per_s2 = 0.5;
// Largest squared Mahalanobis distance of a detection (four degrees of freedom, 99.9 %), and largest
// distance.
constexpr double kGate = 18.5, kMaxDistance_m = 2.0;
// Largest squared ratio of a single number to its standard deviation (99.9 %), and least log-odds of an
// object that is searched in the images.
constexpr double kSingleGate = 11.0, kFollowed = -1.0;
// Log-odds of a new object, changes by a detection and by a stamp without one, and their bounds. An object
// ends at the lower bound.
constexpr double kNew = -1.8, kHit = 0.9, kMiss = -0.25, kLeast = -2.5, kMost = 3.0;
// Bounds of the change without a detection.
constexpr double kLeastChange = -0.6, kMostChange = 0.25;
// Two objects this near with like velocities are one.
constexpr double kTwin_m = 0.7, kTwin_m_per_s = 0.8;
// Part of an object's size that is kept from stamp to stamp: it is not always seen whole.
constexpr double kKeptSize = 0.97;
// An object is reported once its speed has exceeded this number of standard deviations, and its travel since
// it was first detected this squared Mahalanobis distance (two degrees of freedom, 78 %): wrong groups jump,
// but stay, and are not detected so many times.
constexpr double kMovingSigmas = 2.0, kTravel = 3.0;
constexpr int kManyDetections = 5;
// Nobody walks faster; part of the drift of contacts that is kept from stamp to stamp.
constexpr double kFastest_m_per_s = 2.5, kKeptDrift = 0.7;
// What looks like a person is reported once it moves at this least speed and number of standard deviations:
// few things that stand do. Part of the likeness that is kept from view to view.
constexpr double kPersonLikeness = -0.2, kPersonSigmas = 1.0, kSlowest_m_per_s = 0.2, kKeptLikeness = 0.7;
// An object that stands is reported for this time.
constexpr double kKeptStanding_s = 2.0;
// Errors that successive measurements of an object have in common, which the filter cannot average: of the
// position per range along the view, since shadows and feet pull contacts, and across it; of the velocity.
constexpr double kCommonAlong = 0.07, kCommonAcross_m = 0.1;
constexpr double kCommonAlong_m_per_s = 0.4, kCommonAcross_m_per_s = 0.2;
constexpr double kPersonRadius_m = 0.25;
constexpr double kCarWidth_m = 1.8, kCarLength_m = 4.2, kMinCarWidth_m = 1.2;
constexpr double kChildHeight_m = 1.35;

/// Distance from the middle of an object to its side that faces a camera: the radius of a person, or the
/// extent of a car's outline along the view.
double depthBehindSide(double width_m, const Eigen::Vector2d& away, const Eigen::Vector2d& velocity) {
  if (width_m <= kMinCarWidth_m || velocity.norm() < 1e-3) {
    return kPersonRadius_m;
  }
  const double along = std::abs(away.dot(velocity.normalized()));
  return 0.5 * (kCarLength_m * along + kCarWidth_m * std::sqrt(std::max(0.0, 1.0 - along * along)));
}

/// A detection as position of the object's middle and velocity, in the fixed frame.
struct Measurement {
  Measurement(const ObjectDetection& detection, double width_m, const RigidTransform& fixed_from_vehicle) {
    const Eigen::Matrix2d rotation = fixed_from_vehicle.rotationMatrix().topLeftCorner<2, 2>();
    const double depth_m = depthBehindSide(width_m, detection.away, detection.velocity_m_per_s);
    state << rotation * (detection.position_m + depth_m * detection.away) +
                 fixed_from_vehicle.translation().head<2>(),
        rotation * detection.velocity_m_per_s;
    Eigen::Matrix4d turn = Eigen::Matrix4d::Zero();
    turn.topLeftCorner<2, 2>() = turn.bottomRightCorner<2, 2>() = rotation;
    covariance = turn * detection.covariance * turn.transpose();
  }
  Eigen::Vector4d state;
  Eigen::Matrix4d covariance = Eigen::Matrix4d::Zero();
};

/// Covariance of position and velocity of what measurements have in common; zero without cameras.
Eigen::Matrix4d commonErrors(const Eigen::Vector2d& position_m,
                             const std::vector<RigidTransform>& fixed_from_cameras) {
  Eigen::Matrix4d covariance = Eigen::Matrix4d::Zero();
  if (fixed_from_cameras.empty()) {
    return covariance;
  }
  const auto viewFrom = [&](const RigidTransform& fixed_from_camera) -> Eigen::Vector2d {
    return position_m - fixed_from_camera.translation().head<2>();
  };
  const auto nearest = std::min_element(
      fixed_from_cameras.begin(), fixed_from_cameras.end(),
      [&](const auto& a, const auto& b) { return viewFrom(a).squaredNorm() < viewFrom(b).squaredNorm(); });
  const Eigen::Vector2d view_m = viewFrom(*nearest), along = view_m.normalized();
  const Eigen::Matrix2d along_view = along * along.transpose();
  const Eigen::Matrix2d across_view = Eigen::Matrix2d::Identity() - along_view;
  covariance.topLeftCorner<2, 2>() = kCommonAlong * kCommonAlong * view_m.squaredNorm() * along_view +
                                     kCommonAcross_m * kCommonAcross_m * across_view;
  covariance.bottomRightCorner<2, 2>() = kCommonAlong_m_per_s * kCommonAlong_m_per_s * along_view +
                                         kCommonAcross_m_per_s * kCommonAcross_m_per_s * across_view;
  return covariance;
}

double widthOf(const ObjectDetection& detection) {
  return (detection.left_m - detection.right_m).norm();
}

}  // namespace

void ObjectFilter::clear() {
  tracks_.clear();
}

void ObjectFilter::predict(Timestamp stamp) {
  const double step_s = tracks_.empty() ? 0.0 : toSeconds(stamp - stamp_);
  stamp_ = stamp;
  Eigen::Matrix4d transition = Eigen::Matrix4d::Identity();
  transition.topRightCorner<2, 2>() = step_s * Eigen::Matrix2d::Identity();
  const double q = kAcceleration_m_per_s2 * kAcceleration_m_per_s2 * step_s;
  Eigen::Matrix4d noise = Eigen::Matrix4d::Zero();
  for (int axis = 0; axis < 2; ++axis) {
    noise(axis, axis) = q * step_s * step_s / 3.0;
    noise(axis, axis + 2) = noise(axis + 2, axis) = q * step_s / 2.0;
    noise(axis + 2, axis + 2) = q;
  }
  for (Track& track : tracks_) {
    track.state = transition * track.state;
    track.covariance = transition * track.covariance * transition.transpose() + noise;
  }
}

void ObjectFilter::update(const std::vector<ObjectDetection>& detections,
                          const RigidTransform& fixed_from_vehicle) {
  std::vector<std::tuple<double, size_t, size_t>> pairs;  // distance, track, detection
  for (size_t d = 0; d < detections.size(); ++d) {
    for (size_t t = 0; t < tracks_.size(); ++t) {
      const Measurement measured(detections[d], std::max(tracks_[t].width_m, widthOf(detections[d])),
                                 fixed_from_vehicle);
      const Eigen::Matrix4d sum = tracks_[t].covariance + measured.covariance;
      const Eigen::Vector4d difference = measured.state - tracks_[t].state;
      const double squared = difference.dot(sum.ldlt().solve(difference));
      if (squared < kGate && difference.head<2>().norm() < kMaxDistance_m) {
        pairs.emplace_back(squared + std::log(sum.determinant()), t, d);
      }
    }
  }
  std::sort(pairs.begin(), pairs.end());
  std::vector<bool> is_used(detections.size(), false), is_hit(tracks_.size(), false);
  for (const auto& [distance, t, d] : pairs) {
    if (is_used[d] || is_hit[t]) {
      continue;
    }
    is_used[d] = is_hit[t] = true;
    Track& track = tracks_[t];
    track.height_m = std::max(kKeptSize * track.height_m, detections[d].height_m);
    track.width_m = std::max(kKeptSize * track.width_m, widthOf(detections[d]));
    const Measurement measured(detections[d], track.width_m, fixed_from_vehicle);
    const Eigen::Matrix4d gain =
        (track.covariance + measured.covariance).ldlt().solve(track.covariance).transpose();
    const Eigen::Matrix4d rest = Eigen::Matrix4d::Identity() - gain;
    track.state += gain * (measured.state - track.state);
    track.covariance =
        rest * track.covariance * rest.transpose() + gain * measured.covariance * gain.transpose();
    if (track.last_seen < stamp_) {
      track.existence_log_odds = std::min(kMost, track.existence_log_odds + kHit);
    }
    track.last_seen = stamp_;
    note(detections[d], measured.state.head<2>(), &track);
  }
  for (size_t d = 0; d < detections.size(); ++d) {
    if (!is_used[d]) {
      const Measurement measured(detections[d], widthOf(detections[d]), fixed_from_vehicle);
      tracks_.push_back({next_id_++, measured.state, measured.covariance, kNew + kHit, detections[d].height_m,
                         widthOf(detections[d]), stamp_, measured.state.head<2>(),
                         measured.covariance.topLeftCorner<2, 2>(), false});
      note(detections[d], measured.state.head<2>(), &tracks_.back());
    }
  }
}

/// Remembers what tells whether an object moves.
void ObjectFilter::note(const ObjectDetection& detection, const Eigen::Vector2d& position_m,
                        Track* track) const {
  if (detection.has_velocity) {
    ++track->num_detections;
    return;
  }
  track->contacts.add(stamp_, position_m);
  track->drift_m_per_s = kKeptDrift * track->drift_m_per_s + (1.0 - kKeptDrift) * detection.drift_m_per_s;
}

/// Whether the contacts of an object that stands apart move by themselves, as the filter finds too.
bool ObjectFilter::walks(const Track& track) const {
  const std::optional<Eigen::Vector2d> found = track.contacts.velocity();
  return found && found->norm() < kFastest_m_per_s && found->norm() > track.drift_m_per_s &&
         found->dot(track.state.tail<2>()) > 0.5 * found->squaredNorm();
}

void ObjectFilter::addLook(size_t index, const std::vector<double>& scores, double log_odds) {
  Track& track = tracks_[index];
  for (const double score : scores) {
    track.likeness = kKeptLikeness * track.likeness + (1.0 - kKeptLikeness) * score;
  }
  track.look_vote = log_odds;
  track.last_look = stamp_;
}

/// Whether an object that looks like a person moves as one, at this number of its speed's standard
/// deviations.
bool ObjectFilter::movesLikePerson(const Track& track, double speed_sigmas) {
  const double speed = track.state.tail<2>().norm();
  return track.likeness > kPersonLikeness && speed_sigmas > kPersonSigmas && speed > kSlowest_m_per_s &&
         speed < kFastest_m_per_s;
}

std::vector<ObjectFilter::Expected> ObjectFilter::expected() const {
  std::vector<Expected> result;
  for (size_t i = 0; i < tracks_.size(); ++i) {
    const Track& track = tracks_[i];
    if (track.existence_log_odds >= kFollowed) {
      result.push_back({i, track.state.head<2>(), track.state.tail<2>(), track.width_m, track.height_m,
                        track.last_seen == stamp_, track.last_look});
    }
  }
  return result;
}

bool ObjectFilter::correct(size_t index, double innovation, const Eigen::Vector4d& row, double sigma) {
  Track& track = tracks_[index];
  const double variance = row.dot(track.covariance * row) + sigma * sigma;
  if (innovation * innovation > kSingleGate * variance) {
    return false;
  }
  const Eigen::Vector4d gain = track.covariance * row / variance;
  const Eigen::Matrix4d rest = Eigen::Matrix4d::Identity() - gain * row.transpose();
  track.state += innovation * gain;
  track.covariance = rest * track.covariance * rest.transpose() + sigma * sigma * gain * gain.transpose();
  return true;
}

/// Keeps the older one where two objects are one.
void ObjectFilter::mergeTwins() {
  std::vector<Track> kept;
  for (const Track& track : tracks_) {
    const bool is_twin = std::any_of(kept.begin(), kept.end(), [&](const Track& older) {
      return (older.state.head<2>() - track.state.head<2>()).norm() < kTwin_m + 0.4 * older.width_m &&
             (older.state.tail<2>() - track.state.tail<2>()).norm() < kTwin_m_per_s;
    });
    if (!is_twin) {
      kept.push_back(track);
    }
  }
  tracks_ = std::move(kept);
}

void ObjectFilter::finish() {
  for (Track& track : tracks_) {
    const Eigen::Vector2d travel_m = track.state.head<2>() - track.start_m;
    const Eigen::Matrix2d covariance = track.start_covariance + track.covariance.topLeftCorner<2, 2>();
    const Eigen::Vector2d velocity = track.state.tail<2>();
    const double variance = velocity.dot(track.covariance.bottomRightCorner<2, 2>() * velocity);
    const double speed_sigmas = variance > 0.0 ? velocity.squaredNorm() / std::sqrt(variance) : 0.0;
    const bool is_fast = speed_sigmas > kMovingSigmas;
    const bool travels = is_fast && travel_m.dot(covariance.ldlt().solve(travel_m)) > kTravel;
    track.contacts.forgetBefore(stamp_);
    track.has_moved = track.has_moved || (travels && track.num_detections > 0) || (is_fast && walks(track)) ||
                      movesLikePerson(track, speed_sigmas) || track.num_detections >= kManyDetections;
    if (track.last_seen < stamp_) {
      track.existence_log_odds =
          std::min(kMost, track.existence_log_odds +
                              std::clamp(kMiss + track.votes + track.look_vote, kLeastChange, kMostChange));
    }
    track.votes = 0.0;
    if (track.last_seen == stamp_ || is_fast) {
      track.last_moving = stamp_;
    }
  }
  tracks_.erase(std::remove_if(tracks_.begin(), tracks_.end(),
                               [](const Track& track) { return track.existence_log_odds < kLeast; }),
                tracks_.end());
  mergeTwins();
}

TrackedObject ObjectFilter::describe(const Track& track, const Eigen::Matrix4d& covariance) {
  TrackedObject object;
  object.id = track.id;
  object.existence_probability = 1.0 / (1.0 + std::exp(-track.existence_log_odds));
  const Eigen::Vector2d velocity = track.state.tail<2>();
  const double speed = velocity.norm();
  const double heading_rad = std::atan2(velocity.y(), velocity.x());
  const bool is_car = track.width_m > kMinCarWidth_m;
  object.object_class = is_car                            ? ObjectClass::kCar
                        : track.height_m < kChildHeight_m ? ObjectClass::kChild
                                                          : ObjectClass::kAdult;
  object.class_probability = 0.7;
  object.frame_from_object = RigidTransform::planar(track.state.x(), track.state.y(), heading_rad);
  object.velocity_m_per_s = Eigen::Vector3d(velocity.x(), velocity.y(), 0.0);
  object.is_standing = speed < 0.1;
  for (int row = 0; row < 2; ++row) {
    for (int column = 0; column < 2; ++column) {
      object.covariance(row, column) = covariance(row, column);
      object.covariance(row, column + 3) = covariance(row, column + 2);
      object.covariance(row + 3, column) = covariance(row + 2, column);
      object.covariance(row + 3, column + 3) = covariance(row + 2, column + 2);
    }
  }
  object.height_m = track.height_m;
  const auto corner = [&](double x_m, double y_m) {
    return Eigen::Vector2d((object.frame_from_object * Eigen::Vector3d(x_m, y_m, 0.0)).head<2>());
  };
  if (is_car) {
    const double length_m = std::max(kCarLength_m, track.width_m);
    object.footprint_m = {
        corner(-0.5 * length_m, -0.5 * kCarWidth_m), corner(0.5 * length_m, -0.5 * kCarWidth_m),
        corner(0.5 * length_m, 0.5 * kCarWidth_m), corner(-0.5 * length_m, 0.5 * kCarWidth_m)};
  } else {
    constexpr int kNumCorners = 8;
    for (int i = 0; i < kNumCorners; ++i) {
      const double angle_rad = 2.0 * M_PI * i / kNumCorners;
      object.footprint_m.push_back(
          corner(kPersonRadius_m * std::cos(angle_rad), kPersonRadius_m * std::sin(angle_rad)));
    }
  }
  return object;
}

std::vector<TrackedObject> ObjectFilter::objects(
    const std::vector<RigidTransform>& fixed_from_cameras) const {
  std::vector<TrackedObject> found;
  for (const Track& track : tracks_) {
    if (track.existence_log_odds >= 0.0 && track.has_moved &&
        toSeconds(stamp_ - track.last_moving) < kKeptStanding_s) {
      found.push_back(
          describe(track, track.covariance + commonErrors(track.state.head<2>(), fixed_from_cameras)));
    }
  }
  return found;
}

}  // namespace vcharge
