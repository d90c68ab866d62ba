#include "vcharge_evaluation/object_errors.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <deque>

#include <Eigen/Cholesky>

#include "objects/assignment.h"
#include "vcharge_core/base/error.h"

namespace vcharge {
namespace {

constexpr Duration kSpeedTime(500'000'000), kVisibleTime(500'000'000), kCrossingTime(1'000'000'000);
constexpr double kApproached_m = 1.5, kAway_m = 2.0, kStanding_m = 0.02;
/// Least existence probability of a reported object that is judged.
constexpr double kMinExistence = 0.5;
// Largest errors of a good report.
constexpr double kGoodPosition_m = 0.3, kGoodVelocity_m_per_s = 0.3;
constexpr double kMissedVelocity_m_per_s = 1.0;
constexpr size_t kMinFalseFrames = 3;
constexpr double kFalseDistance_m = 1.0;
constexpr std::array<double, 4> kDistances_m = {0.0, 2.0, 4.0, 8.0};
// 95 % of the squares of normal errors in two dimensions, each divided by its variance, are less.
constexpr double kChiSquare95 = 5.991464547107979;

RigidTransform levelled(const RigidTransform& frame_from_vehicle) {
  return RigidTransform::planar(frame_from_vehicle.translation().x(), frame_from_vehicle.translation().y(),
                                yawOfRotation(frame_from_vehicle.rotation()));
}

}  // namespace

/// A true or reported object in the vehicle's frame; its velocity is that over the ground.
struct ObjectEvaluator::Body {
  const TrackedObject* object;
  Outline outline;
  double distance_m;  // between the outlines of the vehicle and the object
  Eigen::Vector2d centre_m, velocity_m_per_s;
  Eigen::Matrix2d covariance_m2;
};

/// One true object in one image in which it was due.
struct ObjectEvaluator::Sample {
  Timestamp stamp;
  ObjectClass object_class;
  double distance_m;
  bool found;
  bool right_class;
  double position_error_m, centre_error_m, velocity_error_m_per_s;
  std::optional<double> normalized_error;
};

/// What is known of a true object from earlier images.
struct ObjectEvaluator::Track {
  ObjectClass object_class = ObjectClass::kUnknown;
  std::deque<std::pair<Timestamp, Eigen::Vector2d>> positions_m;  // in the world, over kSpeedTime
  std::optional<Timestamp> near_since;                            // visible and near without interruption
  std::optional<Timestamp> moving_since;  // first image in which it moves, visible and near
  std::optional<Timestamp> found;
  bool was_due = false;
  bool was_away = false;                   // farther than kAway_m since it was last near
  std::optional<Timestamp> reported;       // last image with a report
  std::optional<double> first_reported_m;  // since it came into sight
  Crossing crossing;                       // has no images while the object is not due

  /// Mean speed over the last kSpeedTime; 0 while less time is known.
  double addPosition(Timestamp stamp, const Eigen::Vector2d& position_m) {
    positions_m.emplace_back(stamp, position_m);
    while (positions_m.size() > 2 && positions_m[1].first <= stamp - kSpeedTime) {
      positions_m.pop_front();
    }
    const Duration time = stamp - positions_m.front().first;
    if (time < kSpeedTime) {
      return 0.0;
    }
    double path_m = 0.0;
    for (size_t i = 1; i < positions_m.size(); ++i) {
      path_m += (positions_m[i].second - positions_m[i - 1].second).norm();
    }
    return path_m / toSeconds(time);
  }

  /// Keeps the crossing if it took long enough.
  void addCrossing(std::vector<Crossing>* crossings) const {
    if (crossing.num_due > 0 && crossing.to - crossing.from >= kCrossingTime) {
      crossings->push_back(crossing);
    }
  }
  void endCrossing(std::vector<Crossing>* crossings) {
    addCrossing(crossings);
    crossing = {};
  }
};

std::vector<size_t> countPointsOn(const std::vector<TrackedObject>& objects,
                                  const std::vector<SeenPoint>& points) {
  constexpr float kMargin_m = 0.05F;
  std::vector<size_t> counts;
  for (const TrackedObject& object : objects) {
    const auto base_m = static_cast<float>(object.base_z_m);
    Eigen::AlignedBox3f box;
    for (const Eigen::Vector2d& corner : object.footprint_m) {
      const Eigen::Vector2f corner_m = corner.cast<float>();
      box.extend(Eigen::Vector3f(corner_m.x() - kMargin_m, corner_m.y() - kMargin_m, base_m + kMargin_m));
      box.extend(Eigen::Vector3f(corner_m.x() + kMargin_m, corner_m.y() + kMargin_m,
                                 base_m + static_cast<float>(object.height_m) + kMargin_m));
    }
    counts.push_back(static_cast<size_t>(std::count_if(points.begin(), points.end(), [&](const auto& point) {
      return box.contains(point.world_m) &&
             distanceToPolygon(point.world_m.template head<2>().template cast<double>(),
                               object.footprint_m) <= static_cast<double>(kMargin_m);
    })));
  }
  return counts;
}

double ObjectErrors::false_per_minute() const {
  return duration_s > 0.0 ? 60.0 * static_cast<double>(false_objects.size()) / duration_s : 0.0;
}

ObjectEvaluator::ObjectEvaluator(const ObjectEvaluationOptions& options)
    : options_((options.validate(), options)),
      vehicle_(vehicleOutline(RigidTransform(), kVehicleFront_m, kVehicleRear_m, kVehicleHalfWidth_m)) {}

ObjectEvaluator::~ObjectEvaluator() = default;

ObjectEvaluator::Body ObjectEvaluator::bodyOf(const TrackedObject& object,
                                              const RigidTransform& vehicle_from_frame) const {
  Body body;
  body.object = &object;
  for (const Eigen::Vector2d& corner : object.footprint_m) {
    body.outline.emplace_back((vehicle_from_frame * Eigen::Vector3d(corner.x(), corner.y(), 0.0)).head<2>());
  }
  body.distance_m = distanceBetween(vehicle_, body.outline);
  body.centre_m = (vehicle_from_frame * object.frame_from_object.translation()).head<2>();
  const Eigen::Matrix2d rotation = vehicle_from_frame.rotationMatrix().topLeftCorner<2, 2>();
  body.velocity_m_per_s = rotation * object.velocity_m_per_s.head<2>();
  body.covariance_m2 = rotation * object.covariance.topLeftCorner<2, 2>() * rotation.transpose();
  return body;
}

Eigen::Vector2d ObjectEvaluator::nearestToVehicle(const Body& body, const Body& mover) const {
  return nearestPoint(body.outline, nearestPoint(vehicle_, mover.outline));
}

std::vector<const ObjectEvaluator::Body*> ObjectEvaluator::assign(const std::vector<Body>& movers,
                                                                  const std::vector<Body>& reports) const {
  Eigen::MatrixXd distances_m(movers.size(), reports.size());
  for (size_t i = 0; i < movers.size(); ++i) {
    const Eigen::Vector2d nearest_m = nearestToVehicle(movers[i], movers[i]);
    for (size_t j = 0; j < reports.size(); ++j) {
      distances_m(static_cast<Eigen::Index>(i), static_cast<Eigen::Index>(j)) =
          (nearestToVehicle(reports[j], movers[i]) - nearest_m).norm();
    }
  }
  std::vector<const Body*> report_of;
  for (const std::optional<size_t>& column : internal::assignLeastCost(distances_m, options_.gate_m)) {
    report_of.push_back(column ? &reports[*column] : nullptr);
  }
  return report_of;
}

void ObjectEvaluator::add(const TrueObjectFrame& truth, const ObjectFrame& reported) {
  check(truth.stamp == reported.stamp && (stamps_.empty() || stamps_.back() < truth.stamp),
        "ObjectEvaluator: expected equal stamps that increase");
  check(truth.objects.size() == truth.visible_fraction.size(),
        "ObjectEvaluator: expected a visible_fraction of each object");
  const RigidTransform vehicle_from_world = levelled(truth.world_from_vehicle).inverse();
  const RigidTransform vehicle_from_odom = levelled(reported.odom_from_vehicle).inverse();
  std::vector<Body> movers, reports;
  for (const TrackedObject& object : truth.objects) {
    movers.push_back(bodyOf(object, vehicle_from_world));
  }
  for (const TrackedObject& object : reported.objects) {
    if (object.existence_probability >= kMinExistence) {
      reports.push_back(bodyOf(object, vehicle_from_odom));
    }
  }
  const std::vector<const Body*> report_of = assign(movers, reports);
  for (auto& [id, track] : tracks_) {
    const bool is_here = std::any_of(movers.begin(), movers.end(),
                                     [id = id](const Body& mover) { return mover.object->id == id; });
    if (!is_here) {
      track.positions_m.clear();
      track.near_since.reset();
      track.endCrossing(&crossings_);
    }
  }
  stamps_.push_back(truth.stamp);
  const bool stands = vehicleStands(truth.world_from_vehicle);
  for (size_t i = 0; i < movers.size(); ++i) {
    Track& track = tracks_[movers[i].object->id];
    track.object_class = movers[i].object->object_class;
    const double speed_m_per_s =
        track.addPosition(truth.stamp, movers[i].object->frame_from_object.translation().head<2>());
    const bool is_near = truth.visible_fraction[i] >= options_.min_visible_fraction &&
                         movers[i].distance_m <= options_.max_distance_m;
    track.near_since = is_near ? track.near_since.value_or(truth.stamp) : std::optional<Timestamp>();
    if (stands && is_near) {
      judgeApproach(movers[i], report_of[i] != nullptr, &track);
    } else {
      track.was_away = false;
      track.reported.reset();
      track.first_reported_m.reset();
    }
    if (is_near && !movers[i].object->is_standing) {
      track.moving_since = track.moving_since.value_or(truth.stamp);
    }
    if (track.moving_since && !track.found && report_of[i] != nullptr) {
      track.found = truth.stamp;
    }
    if (is_near && truth.stamp - *track.near_since >= kVisibleTime && !movers[i].object->is_standing &&
        speed_m_per_s > options_.min_speed_m_per_s) {
      judgeMover(movers[i], report_of[i], &track);
    } else {
      track.endCrossing(&crossings_);
    }
  }
  countFalse(reports, movers);
}

/// Whether the vehicle has stood for kSpeedTime.
bool ObjectEvaluator::vehicleStands(const RigidTransform& world_from_vehicle) {
  const Eigen::Vector2d position_m = world_from_vehicle.translation().head<2>();
  if (!vehicle_m_ || (position_m - *vehicle_m_).norm() > kStanding_m) {
    vehicle_m_ = position_m;
    stands_since_ = stamps_.back();
  }
  return stamps_.back() - stands_since_ >= kSpeedTime;
}

/// A mover in sight of the standing vehicle.
void ObjectEvaluator::judgeApproach(const Body& mover, bool is_reported, Track* track) {
  const Timestamp stamp = stamps_.back();
  if (mover.distance_m < kApproached_m && track->was_away) {
    const bool was_reported = track->reported && stamp - *track->reported <= kVisibleTime;
    approaches_.push_back(
        {mover.object->id, track->object_class, stamp, was_reported, track->first_reported_m.value_or(0.0)});
    track->was_away = false;
  } else if (mover.distance_m > kAway_m && stamp - *track->near_since >= kVisibleTime) {
    track->was_away = true;
  }
  if (is_reported) {
    track->reported = stamp;
    track->first_reported_m = track->first_reported_m.value_or(mover.distance_m);
  }
}

void ObjectEvaluator::judgeMover(const Body& mover, const Body* report, Track* track) {
  const Timestamp stamp = stamps_.back();
  Sample sample{stamp, track->object_class, mover.distance_m, report != nullptr,
                false, options_.gate_m,     options_.gate_m,  kMissedVelocity_m_per_s,
                {}};
  track->was_due = true;
  Crossing& crossing = track->crossing;
  if (crossing.num_due == 0) {
    crossing = Crossing{mover.object->id, track->object_class, stamp, stamp, 0, 0, {}};
  }
  crossing.to = stamp;
  ++crossing.num_due;
  if (report != nullptr) {
    ++crossing.num_found;
    crossing.ids.insert(report->object->id);
    const Eigen::Vector2d centre_error_m = report->centre_m - mover.centre_m;
    sample.right_class = report->object->object_class == track->object_class;
    sample.position_error_m = (nearestToVehicle(*report, mover) - nearestToVehicle(mover, mover)).norm();
    sample.centre_error_m = centre_error_m.norm();
    sample.velocity_error_m_per_s = (report->velocity_m_per_s - mover.velocity_m_per_s).norm();
    sample.normalized_error = kMaxNormalizedError;
    const Eigen::LLT<Eigen::Matrix2d> factor(report->covariance_m2);
    if (factor.info() == Eigen::Success) {
      sample.normalized_error =
          std::min(kMaxNormalizedError, factor.matrixL().solve(centre_error_m).squaredNorm());
    }
  }
  samples_.push_back(sample);
}

void ObjectEvaluator::countFalse(const std::vector<Body>& reports, const std::vector<Body>& movers) {
  for (const Body& report : reports) {
    // Assigned reports are within the gate of a mover, and those near a mover may be a second report of it.
    const bool is_false = !report.object->is_standing && report.distance_m <= options_.max_distance_m &&
                          std::none_of(movers.begin(), movers.end(), [&](const Body& mover) {
                            return distanceBetween(report.outline, mover.outline) <= kFalseDistance_m;
                          });
    if (is_false) {
      FalseObject& object =
          unmatched_.try_emplace(report.object->id, FalseObject{report.object->id, 0, stamps_.back()})
              .first->second;
      ++object.num_frames;
    }
  }
}

ObjectFigures ObjectEvaluator::figuresOf(const std::function<bool(const Sample&)>& isChosen) const {
  ObjectFigures figures;
  std::vector<double> position_m, centre_m, velocity_m_per_s;
  for (const Sample& sample : samples_) {
    if (!isChosen(sample)) {
      continue;
    }
    const bool good_position = sample.found && sample.position_error_m <= kGoodPosition_m;
    const bool good_velocity = sample.found && sample.velocity_error_m_per_s <= kGoodVelocity_m_per_s;
    ++figures.num_due;
    figures.num_found += sample.found ? 1 : 0;
    figures.num_good_position += good_position ? 1 : 0;
    figures.num_good_velocity += good_velocity ? 1 : 0;
    figures.num_good += good_position && good_velocity ? 1 : 0;
    figures.num_right_class += sample.right_class ? 1 : 0;
    position_m.push_back(sample.position_error_m);
    centre_m.push_back(sample.centre_error_m);
    velocity_m_per_s.push_back(sample.velocity_error_m_per_s);
  }
  figures.position_error_m = summarize(position_m);
  figures.centre_error_m = summarize(centre_m);
  figures.velocity_error_m_per_s = summarize(velocity_m_per_s);
  return figures;
}

ObjectErrors ObjectEvaluator::errors() const {
  ObjectErrors errors;
  errors.num_frames = stamps_.size();
  errors.duration_s = stamps_.empty() ? 0.0 : toSeconds(stamps_.back() - stamps_.front());
  errors.all = figuresOf([](const Sample&) { return true; });
  std::map<Timestamp, double> sums;
  std::vector<double> normalized_errors;
  for (const Sample& sample : samples_) {
    errors.by_class.try_emplace(sample.object_class);
    sums[sample.stamp] += sample.position_error_m + sample.velocity_error_m_per_s;
    if (sample.normalized_error) {
      normalized_errors.push_back(*sample.normalized_error);
      errors.num_normalized_within_95 += *sample.normalized_error <= kChiSquare95 ? 1 : 0;
    }
  }
  errors.normalized_error = summarize(normalized_errors);
  for (auto& [object_class, figures] : errors.by_class) {
    figures = figuresOf([each = object_class](const Sample& sample) { return sample.object_class == each; });
  }
  for (size_t i = 0; i + 1 < kDistances_m.size(); ++i) {
    const double from_m = kDistances_m[i];
    const double to_m = i + 2 < kDistances_m.size() ? kDistances_m[i + 1] : options_.max_distance_m;
    errors.by_distance.push_back({from_m, to_m, figuresOf([&](const Sample& sample) {
                                    return sample.distance_m >= from_m &&
                                           (i + 2 == kDistances_m.size() || sample.distance_m < to_m);
                                  })});
  }
  const auto worst = std::max_element(sums.begin(), sums.end(),
                                      [](const auto& a, const auto& b) { return a.second < b.second; });
  if (worst != sums.end()) {
    errors.worst = worst->first;
  }
  errors.approaches = approaches_;
  errors.crossings = crossings_;
  for (const auto& [id, track] : tracks_) {
    track.addCrossing(&errors.crossings);
    if (track.was_due) {
      const double delay_s = track.found ? toSeconds(*track.found - *track.moving_since) : errors.duration_s;
      errors.first_reports.push_back({id, track.object_class, track.found.has_value(), delay_s});
    }
  }
  for (const auto& [id, object] : unmatched_) {
    if (object.num_frames >= kMinFalseFrames) {
      errors.false_objects.push_back(object);
    }
  }
  return errors;
}

}  // namespace vcharge
