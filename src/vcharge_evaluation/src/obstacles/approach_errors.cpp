#include "vcharge_evaluation/approach_errors.h"

#include <algorithm>
#include <cmath>
#include <iterator>
#include <limits>

#include "obstacles/judged_map.h"

namespace vcharge {
namespace {

using internal::kMaxHeight_m;
using internal::kMinSeenPoints;
using internal::kOpenHeight_m;
using internal::kOpenRadius_m;
using internal::kSeenHeight_m;
using internal::kTolerance_m;

constexpr double kPathStep_m = 0.25;  // between footprints that make up the corridor
constexpr double kStanding_m_per_s = 0.05;
// The vehicle's own path ahead and behind is judged at these distances from it, once it has driven so far.
constexpr double kNear_m = 0.5, kFar_m = 4.0, kStart_m = 2.0;

}  // namespace

struct ApproachEvaluator::Frame : internal::JudgedMap {
  using JudgedMap::JudgedMap;

  std::vector<Eigen::Vector2d> outline;
  double speed_m_per_s = 0.0;
  SeenCells seen;
};

/// Footprints of the vehicle on the next part of its path.
struct ApproachEvaluator::Corridor {
  std::vector<std::vector<Eigen::Vector2d>> footprints;

  bool contains(const Eigen::Vector2d& point) const {
    return std::any_of(footprints.begin(), footprints.end(),
                       [&](const auto& footprint) { return distanceToPolygon(point, footprint) <= 0.0; });
  }
};

void CorridorCounts::add(bool is_occupied, int8_t state) {
  size_t& count = is_occupied ? (state == kCellOccupied ? occupied_as_occupied
                                 : state == kCellFree   ? occupied_as_free
                                                        : occupied_as_unknown)
                              : (state == kCellOccupied ? free_as_occupied
                                 : state == kCellFree   ? free_as_free
                                                        : free_as_unknown);
  ++count;
}

ApproachEvaluator::ApproachEvaluator(const std::vector<TruthObstacle>& obstacles, const TruthHeights& heights,
                                     Trajectory path, const ApproachEvaluationOptions& options)
    : options_((options.validate(), options)), heights_(heights), path_(std::move(path)) {
  highest_around_ = internal::highestWithin(heights, kOpenRadius_m);
  std::vector<std::vector<Eigen::Vector2d>> driven;
  std::optional<Eigen::Vector2d> last_m;
  for (const StampedTransform& pose : path_) {
    const Eigen::Vector2d position_m = pose.world_from_vehicle.translation().head<2>();
    if (!last_m || (position_m - *last_m).norm() >= kPathStep_m) {
      driven.push_back(outline(pose.world_from_vehicle, 0.0));
      last_m = position_m;
    }
  }
  for (const TruthObstacle& obstacle : obstacles) {
    const bool is_near = std::any_of(driven.begin(), driven.end(), [&](const auto& footprint) {
      return distanceBetween(footprint, obstacle.footprint_m) <= options_.max_gap_m;
    });
    if (is_near && obstacle.height_m() >= options_.min_height_m && obstacle.base_z_m < kMaxHeight_m) {
      standing_.push_back(obstacle);
    }
  }
}

std::vector<Eigen::Vector2d> ApproachEvaluator::outline(const RigidTransform& world_from_vehicle,
                                                        double margin_m) const {
  return vehicleOutline(world_from_vehicle, kVehicleFront_m, kVehicleRear_m, kVehicleHalfWidth_m + margin_m);
}

void ApproachEvaluator::add(const ObstacleMap& map, const std::vector<SeenPoint>& points,
                            const RigidTransform& world_from_vehicle,
                            const std::vector<TruthObstacle>& movers) {
  const Eigen::Vector2d position_m = world_from_vehicle.translation().head<2>();
  Frame frame(map, world_from_vehicle);
  frame.outline = outline(frame.level, 0.0);
  if (last_ && map.stamp > *last_) {
    const double step_m = (position_m - *last_position_m_).norm();
    frame.speed_m_per_s = step_m / toSeconds(map.stamp - *last_);
    sums_.driven_m += step_m;
  }
  first_ = first_.value_or(map.stamp);
  last_ = map.stamp;
  last_position_m_ = position_m;
  for (const SeenPoint& point : points) {
    if (point.world_m.z() >= kSeenHeight_m && point.world_m.z() <= kMaxHeight_m) {
      frame.seen.add(point.world_m.head<2>().cast<double>());
    }
  }
  for (size_t i = 0; i < standing_.size(); ++i) {
    judgeObstacle(frame, standing_[i], static_cast<int>(i));
  }
  for (size_t i = 0; i < movers.size(); ++i) {
    judgeObstacle(frame, movers[i], -1 - static_cast<int>(i));
  }
  judgeCorridor(frame, movers);
}

void ApproachEvaluator::judgeObstacle(const Frame& frame, const TruthObstacle& obstacle, int key) {
  const double distance_m = distanceBetween(frame.outline, obstacle.footprint_m);
  auto found = reports_.find(key);
  if (found == reports_.end()) {
    if (internal::seenPointsOf(frame.seen, obstacle) < kMinSeenPoints) {
      return;
    }
    found = reports_.emplace(key, FirstReport{obstacle.kind, key < 0, distance_m, distance_m, {}, {}}).first;
  }
  FirstReport& report = found->second;
  report.nearest_m = std::min(report.nearest_m, distance_m);
  if (!report.reported_m && frame.reports(obstacle)) {
    // A report that comes once the obstacle is farther away again came too late.
    report.reported_m = report.nearest_m;
    if (frame.speed_m_per_s > kStanding_m_per_s) {
      report.contact_s = report.nearest_m / frame.speed_m_per_s;
    }
  }
}

std::optional<bool> ApproachEvaluator::truthAt(const Eigen::Vector2d& world_m,
                                               const std::vector<TruthObstacle>& movers) const {
  double nearest_mover_m = std::numeric_limits<double>::infinity();
  for (const TruthObstacle& mover : movers) {
    nearest_mover_m = std::min(nearest_mover_m, distanceToPolygon(world_m, mover.footprint_m));
  }
  const float height_m = heights_.at(heights_.height_m, world_m);
  if (nearest_mover_m <= 0.0 || height_m >= static_cast<float>(options_.min_height_m)) {
    return true;
  }
  if (nearest_mover_m <= kTolerance_m ||
      !(heights_.at(highest_around_, world_m) < static_cast<float>(kOpenHeight_m))) {
    return std::nullopt;
  }
  return false;
}

ApproachEvaluator::Corridor ApproachEvaluator::corridorFrom(Timestamp stamp, bool is_forward, double length_m,
                                                            double margin_m) const {
  Corridor corridor;
  double travel_m = 0.0, since_m = kPathStep_m;
  const auto now =
      std::lower_bound(path_.begin(), path_.end(), stamp,
                       [](const StampedTransform& each, Timestamp time) { return each.stamp < time; });
  const auto addFrom = [&](auto pose, auto end) {
    for (auto last = pose; pose != end && travel_m <= length_m; last = pose++) {
      const double step_m =
          (pose->world_from_vehicle.translation() - last->world_from_vehicle.translation()).norm();
      travel_m += step_m;
      since_m += step_m;
      if (since_m >= kPathStep_m) {
        corridor.footprints.push_back(outline(pose->world_from_vehicle, margin_m));
        since_m = 0.0;
      }
    }
  };
  if (is_forward) {
    addFrom(now, path_.end());
  } else {
    addFrom(std::make_reverse_iterator(now), path_.rend());
  }
  return corridor;
}

void ApproachEvaluator::judgeCorridor(const Frame& frame, const std::vector<TruthObstacle>& movers) {
  const double reach_m = options_.corridor_m + kVehicleFront_m - kVehicleRear_m;
  const Eigen::Vector2d here_m = frame.level.translation().head<2>();
  const auto countCells = [&](const Corridor& corridor, double from_m, double to_m, const auto& add) {
    frame.forEachCell([&](int column, int row, int8_t state) {
      const Eigen::Vector2d world_m = frame.worldOf(column, row);
      if ((world_m - here_m).norm() > reach_m) {
        return;
      }
      const double distance_m = distanceToPolygon(world_m, frame.outline);
      if (distance_m <= from_m || distance_m > to_m || !corridor.contains(world_m)) {
        return;
      }
      if (const std::optional<bool> truth = truthAt(world_m, movers)) {
        add(column, row, state, *truth);
      }
    });
  };
  countCells(corridorFrom(frame.map.stamp, true, options_.corridor_m, options_.margin_m), 0.0,
             std::numeric_limits<double>::infinity(), [&](int column, int row, int8_t state, bool truth) {
               sums_.corridor.add(truth, state);
               bool& was_alarm = was_alarm_[SeenCells::keyOf(frame.fixedOf(column, row))];
               const bool is_alarm = !truth && state == kCellOccupied;
               sums_.num_false_alarms += is_alarm && !was_alarm ? 1 : 0;
               was_alarm = is_alarm;
             });
  if (!hasDriven()) {
    return;
  }
  for (const bool is_forward : {true, false}) {
    CorridorCounts& counts = is_forward ? sums_.ahead : sums_.behind;
    countCells(corridorFrom(frame.map.stamp, is_forward, kFar_m, 0.0), kNear_m, kFar_m,
               [&](int /*column*/, int /*row*/, int8_t state, bool truth) { counts.add(truth, state); });
  }
}

bool ApproachEvaluator::hasDriven() const {
  return sums_.driven_m >= kStart_m;
}

ApproachErrors ApproachEvaluator::errors() const {
  ApproachErrors errors = sums_;
  for (const auto& [key, report] : reports_) {
    errors.reports.push_back(report);
  }
  errors.duration_s = first_ ? toSeconds(*last_ - *first_) : 0.0;
  return errors;
}

}  // namespace vcharge
