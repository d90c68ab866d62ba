#include "vcharge_obstacles/local_obstacle_map.h"

#include <algorithm>
#include <cmath>
#include <limits>

#include "fusion/cell_observation.h"
#include "ground/ground_shadows.h"
#include "vcharge_core/base/error.h"

namespace vcharge {
namespace {

// Factor on the weight of earlier observations; below 1, so that a cell follows the odometry's drift.
constexpr float kMemory = 0.9F;
// Distance along the ray, in sigmas, over which an observation is spread. Evidence further away would
// accumulate over many observations with the same error.
constexpr double kObservationSigmas = 1.0;
// Log-odds of an obstacle with full support and small sigma, and of a cell whose pixels all show ground.
constexpr double kOccupiedLogOdds = 0.9;
constexpr double kFreeLogOdds = 0.6;
// Above this sigma, an observation's weight falls with the square: many uncertain observations with a common
// error would mark ground far from the obstacle.
constexpr double kSharpSigma_m = 0.12;
// Minimum fractions of a cell's pixels: that show ground, for evidence of free ground; that hide ground, for
// decay of a free cell; that have changed for a free cell to be reset.
constexpr double kMinFreeFraction = 0.4;
constexpr double kMinHiddenFraction = 0.5;
constexpr double kMinChangedFraction = 0.4;
// Factors on the log-odds of a free cell whose ground is hidden, or has no range.
constexpr double kHiddenDecay = 0.5;
constexpr double kUnknownDecay = 0.7;
// Time for which changed ground cannot become free.
constexpr double kChangedHold_s = 0.3;
// Within this angle of the direction of travel missing ranges give no evidence: stereo has no parallax.
constexpr double kBlindAngle_rad = 0.35;

RigidTransform levelled(const RigidTransform& transform) {
  return RigidTransform::planar(transform.translation().x(), transform.translation().y(),
                                yawOfRotation(transform.rotation()));
}

Eigen::Vector2d transformed(const RigidTransform& transform, const Eigen::Vector2d& point_m) {
  return (transform * Eigen::Vector3d(point_m.x(), point_m.y(), 0.0)).head<2>();
}

}  // namespace

LocalObstacleMap::LocalObstacleMap(const LocalObstacleMapOptions& options)
    : options_((options.validate(), options)),
      cells_(2 * static_cast<int>(std::lround(options.half_size_m / options.cell_size_m)),
             options.cell_size_m) {}

void LocalObstacleMap::decay(double travelled_m, const RigidTransform& fixed_from_vehicle,
                             const GroundArea& is_hidden) {
  const auto keep_occupied = static_cast<float>(std::exp(-travelled_m / options_.decay_occupied_m));
  const auto keep_free = static_cast<float>(std::exp(-travelled_m / options_.decay_free_m));
  const RigidTransform vehicle_from_fixed = fixed_from_vehicle.inverse();
  const double cell_m = options_.cell_size_m;
  for (int64_t y = cells_.firstY(); y < cells_.firstY() + cells_.size(); ++y) {
    for (int64_t x = cells_.firstX(); x < cells_.firstX() + cells_.size(); ++x) {
      Cell& cell = cells_.at(x, y);
      cell.rest_log_odds *= cell.rest_log_odds > 0.0F ? keep_occupied : keep_free;
      if (cell.log_odds > 0.0F) {
        cell.log_odds *= keep_occupied;
      } else if (cell.log_odds < 0.0F &&
                 !(is_hidden &&
                   is_hidden(transformed(vehicle_from_fixed, {(x + 0.5) * cell_m, (y + 0.5) * cell_m})))) {
        cell.log_odds *= keep_free;
      }
    }
  }
}

void LocalObstacleMap::moveTo(Timestamp stamp, const RigidTransform& fixed_from_vehicle,
                              const GroundArea& is_hidden) {
  const RigidTransform level = levelled(fixed_from_vehicle);
  const int64_t first_x = cells_.indexOf(level.translation().x()) - cells_.size() / 2;
  const int64_t first_y = cells_.indexOf(level.translation().y()) - cells_.size() / 2;
  if (has_pose_) {
    const double travelled_m = (level.translation() - fixed_from_vehicle_.translation()).norm();
    if (travelled_m > 0.0) {
      decay(travelled_m, level, is_hidden);
      travel_direction_ = (level.translation() - fixed_from_vehicle_.translation()).head<2>().normalized();
      travel_m_ += travelled_m;
    }
  }
  cells_.moveTo(first_x, first_y);
  has_pose_ = true;
  stamp_ = stamp;
  fixed_from_vehicle_ = level;
}

void LocalObstacleMap::add(const CameraObstacles& seen, const PolarGrid& grid,
                           const RigidTransform& fixed_from_vehicle, bool is_at_rest) {
  check(has_pose_, "LocalObstacleMap::add: moveTo() comes first");
  const RigidTransform level = levelled(fixed_from_vehicle);
  const MapWeight weight{is_at_rest ? weightAtRest(seen) : weightOf(seen, transformed(level, seen.origin_m)),
                         is_at_rest};
  addGround(seen, grid, level, weight);
  addOccupied(seen, grid, level, weight);
}

struct LocalObstacleMap::GroundObservation {
  int64_t x, y;  // index of the cell
  CellObservation cell;
  bool in_shadow;  // hidden by an obstacle observed earlier
  bool may_free;   // near enough to the camera's axis
  bool explained;  // the change is due to a static obstacle
};

GroundShadows LocalObstacleMap::shadowsFor(const CameraObstacles& seen,
                                           const Eigen::Vector2d& camera_m) const {
  GroundShadows shadows(seen.camera_height_m);
  const double cell_m = options_.cell_size_m;
  const int64_t since_ns = (seen.stamp - durationFromSeconds(options_.shadow_s)).nanoseconds();
  cells_.forEach([&](int64_t x, int64_t y, const Cell& cell) {
    if (cell.last_occupied_ns > since_ns && stateOf(cell) == kCellOccupied) {
      const Eigen::Vector2d middle_m((x + 0.5) * cell_m, (y + 0.5) * cell_m);
      shadows.add(middle_m - camera_m, cell_m, cell.height_m);
    }
  });
  return shadows;
}

std::vector<LocalObstacleMap::GroundObservation> LocalObstacleMap::observeGround(
    const CameraObstacles& seen, const CellObserver& observer, const PolarGrid& grid,
    const RigidTransform& fixed_from_vehicle) const {
  const double cell_m = options_.cell_size_m;
  const double blind_sine = std::sin(kBlindAngle_rad);
  const Eigen::Vector2d camera_m = transformed(fixed_from_vehicle, seen.origin_m);
  const double yaw_rad = yawOfRotation(fixed_from_vehicle.rotation());
  const GroundShadows shadows = shadowsFor(seen, camera_m);
  const auto reach = static_cast<int64_t>(std::ceil(options_.free_range_m / cell_m));
  const int64_t middle_x = cells_.indexOf(camera_m.x());
  const int64_t middle_y = cells_.indexOf(camera_m.y());
  std::vector<GroundObservation> observations;
  for (int64_t y = std::max(cells_.firstY(), middle_y - reach);
       y <= std::min(cells_.firstY() + cells_.size() - 1, middle_y + reach); ++y) {
    for (int64_t x = std::max(cells_.firstX(), middle_x - reach);
         x <= std::min(cells_.firstX() + cells_.size() - 1, middle_x + reach); ++x) {
      const Eigen::Vector2d offset_m((x + 0.5) * cell_m - camera_m.x(), (y + 0.5) * cell_m - camera_m.y());
      const double range_m = offset_m.norm();
      const int bin = range_m > 0.0 ? grid.binOfInverse(static_cast<float>(1.0 / range_m)) : grid.numBins();
      if (range_m > options_.free_range_m || bin < 0 || bin >= grid.numBins()) {
        continue;
      }
      const double angle_rad = std::remainder(std::atan2(offset_m.y(), offset_m.x()) - yaw_rad, 2.0 * M_PI);
      const int ray = grid.rayOf(angle_rad);
      const size_t index = grid.index(ray, bin);
      const bool has_changed = !seen.changed_fraction.empty() && seen.changed_fraction[index] > 0.0F;
      if (seen.free_fraction[index] <= 0.0F && seen.hidden_fraction[index] <= 0.0F &&
          seen.unknown_fraction[index] <= 0.0F && !has_changed) {
        continue;
      }
      CellObservation cell = observer.observe(angle_rad, range_m, bin);
      const double across_m =
          std::abs(offset_m.x() * travel_direction_.y() - offset_m.y() * travel_direction_.x());
      if (across_m <= blind_sine * range_m) {
        cell.unknown_fraction = 0.0;  // also before the first motion
      }
      const bool explained =
          cell.changed_fraction >= kMinChangedFraction && observer.isExplained(angle_rad, range_m);
      const bool may_free = seen.free_to_m.empty() || range_m <= seen.free_to_m[static_cast<size_t>(ray)];
      observations.push_back({x, y, cell, shadows.hides(offset_m), may_free, explained});
    }
  }
  return observations;
}

void LocalObstacleMap::addGround(const CameraObstacles& seen, const PolarGrid& grid,
                                 const RigidTransform& fixed_from_vehicle, const MapWeight& weight) {
  const std::vector<GroundObservation> observations =
      observeGround(seen, CellObserver(seen, grid, options_.cell_size_m), grid, fixed_from_vehicle);
  holdChanged(observations, seen.stamp);
  for (const GroundObservation& ground : observations) {
    addGroundObservation(ground, weight, seen.stamp);
  }
}

/// Resets free cells whose ground has changed, and the cells around them.
void LocalObstacleMap::holdChanged(const std::vector<GroundObservation>& observations, Timestamp stamp) {
  for (const GroundObservation& ground : observations) {
    if (ground.cell.changed_fraction >= kMinChangedFraction) {
      hold(ground.x, ground.y, ground.explained ? 0.0 : options_.changed_margin_m, stamp, stamp);
    }
  }
}

void LocalObstacleMap::hold(int64_t x, int64_t y, double radius_m, Timestamp first, Timestamp last) {
  const int64_t until_ns = (last + durationFromSeconds(kChangedHold_s)).nanoseconds();
  const double radius = radius_m / options_.cell_size_m;
  const auto reach = static_cast<int64_t>(radius);
  for (int64_t row = y - reach; row <= y + reach; ++row) {
    for (int64_t column = x - reach; column <= x + reach; ++column) {
      const double distance = std::hypot(static_cast<double>(row - y), static_cast<double>(column - x));
      if (distance <= radius && cells_.isInside(column, row)) {
        Cell& cell = cells_.at(column, row);
        cell.held_until_ns = std::max(cell.held_until_ns, until_ns);
        takeFreedom(first, &cell);
        cell.rest_log_odds = std::max(cell.rest_log_odds, 0.0F);
      }
    }
  }
}

void LocalObstacleMap::addGroundObservation(const GroundObservation& ground, const MapWeight& weight,
                                            Timestamp stamp) {
  const CellObservation& observed = ground.cell;
  Cell* cell = &cells_.at(ground.x, ground.y);
  const bool shows_ground = !observed.blocked && observed.free_fraction >= kMinFreeFraction;
  if (shows_ground && !ground.in_shadow) {
    cell->last_seen_ns = stamp.nanoseconds();
    cell->travel_m = static_cast<float>(travel_m_);
    const bool was_free = stateOf(*cell) == kCellFree;
    clearAtRest(weight.value * observed.free_fraction, cell);
    if (weight.is_at_rest) {
      return;
    }
    const double log_odds = cell->log_odds - weight.value * kFreeLogOdds * observed.free_fraction;
    const bool may_free = stamp.nanoseconds() >= cell->held_until_ns && (ground.may_free || was_free);
    const double least = may_free ? kMinCellLogOdds : std::min(0.0, static_cast<double>(cell->log_odds));
    cell->log_odds = static_cast<float>(std::max(least, log_odds));
  } else if (weight.is_at_rest) {
    if (cell->log_odds < 0.0F && (shows_ground || observed.hidden_fraction >= kMinHiddenFraction)) {
      hideAtRest(weight.value, stamp, cell);
    }
  } else if (cell->log_odds < 0.0F &&
             (shows_ground || observed.hidden_fraction + observed.unknown_fraction >= kMinHiddenFraction)) {
    // An obstacle may now be there or in front of it, so the cell decays towards unobserved.
    const bool hides = shows_ground || observed.hidden_fraction >= observed.unknown_fraction;
    cell->log_odds *= static_cast<float>(std::pow(hides ? kHiddenDecay : kUnknownDecay, weight.value));
  }
}

void LocalObstacleMap::addObstaclePoint(const ObstaclePoint& point, Timestamp stamp) {
  const int64_t x = cells_.indexOf(point.point_m.x());
  const int64_t y = cells_.indexOf(point.point_m.y());
  if (!cells_.isInside(x, y) || point.mass <= 0.0) {
    return;
  }
  Cell& cell = cells_.at(x, y);
  cell.travel_m = static_cast<float>(travel_m_);
  cell.last_seen_ns = cell.last_occupied_ns = stamp.nanoseconds();
  if (!point.is_at_rest) {
    cell.log_odds = std::min(static_cast<float>(kMaxCellLogOdds),
                             cell.log_odds + static_cast<float>(kOccupiedLogOdds * point.mass));
  } else if (!occupyAtRest(point.mass, stamp, &cell)) {
    return;
  }
  const double sigma_m = point.sigma_m;
  const auto weight = static_cast<float>(point.mass / (sigma_m * sigma_m + 1e-4));
  const float kept = kMemory * cell.weight;
  const float gain = weight / (kept + weight);
  const auto blend = [gain](float* mean, double value) {
    *mean += gain * (static_cast<float>(value) - *mean);
  };
  cell.weight = kept + weight;
  blend(&cell.x_m, point.point_m.x() - static_cast<double>(x) * options_.cell_size_m);
  blend(&cell.y_m, point.point_m.y() - static_cast<double>(y) * options_.cell_size_m);
  blend(&cell.sigma_m, sigma_m);
  blend(&cell.height_m, point.obstacle->height_m);
  blend(&cell.height_sigma_m, point.obstacle->height_sigma_m);
}

/// Standard deviation of a range due to the error of the camera's motion across the ray. Directions are in
/// the fixed frame; zero before the first motion.
double LocalObstacleMap::parallaxSigma_m(double range_m, const Eigen::Vector2d& direction) const {
  constexpr double kLeastSine = 0.03;
  const double across =
      std::abs(direction.x() * travel_direction_.y() - direction.y() * travel_direction_.x());
  const double along = std::abs(direction.dot(travel_direction_));
  return kParallaxSigma * range_m * along / std::max(across, kLeastSine);
}

void LocalObstacleMap::addOccupied(const CameraObstacles& seen, const PolarGrid& grid,
                                   const RigidTransform& fixed_from_vehicle, const MapWeight& weight) {
  const double cell_m = options_.cell_size_m;
  const double yaw_rad = yawOfRotation(fixed_from_vehicle.rotation());
  for (const PolarObstacle& obstacle : seen.obstacles) {
    if (obstacle.is_off_axis || obstacle.range_m > options_.occupied_range_m) {
      continue;
    }
    const double width_m = obstacle.range_m * grid.increment_rad();
    const int across = std::max(1, static_cast<int>(std::ceil(width_m / cell_m)));
    // Close to the camera, several rays meet one cell and together count as one observation.
    const double ray_mass = weight.value * obstacle.weight * std::min(1.0, width_m / cell_m * 1.5) *
                            std::max(0.3, obstacle.support);
    const double middle_rad = grid.angle_rad(obstacle.ray) + yaw_rad;
    const Eigen::Vector2d middle(std::cos(middle_rad), std::sin(middle_rad));
    const double parallax_sigma_m = weight.is_at_rest ? 0.0 : parallaxSigma_m(obstacle.range_m, middle);
    const double sigma_m = std::hypot(obstacle.range_sigma_m, parallax_sigma_m);
    const double sharpness = std::min(1.0, kSharpSigma_m / sigma_m);
    const double observation_mass = sharpness * sharpness * ray_mass;
    const int along =
        sigma_m < 0.6 * cell_m ? 0 : static_cast<int>(std::ceil(kObservationSigmas * sigma_m / cell_m));
    double normalizer = 0.0;
    const auto density = [&](int step) {
      const double z = step * cell_m / sigma_m;
      return std::exp(-0.5 * z * z);
    };
    for (int step = -along; step <= along; ++step) {
      normalizer += density(step);
    }
    for (int side = 0; side < across; ++side) {
      const double angle_rad =
          grid.angle_rad(obstacle.ray) + ((side + 0.5) / across - 0.5) * grid.increment_rad();
      const Eigen::Vector2d direction(std::cos(angle_rad), std::sin(angle_rad));
      for (int step = -along; step <= along; ++step) {
        const Eigen::Vector2d point_in_vehicle =
            seen.origin_m + (obstacle.range_m + step * cell_m) * direction;
        addObstaclePoint(
            {transformed(fixed_from_vehicle, point_in_vehicle), observation_mass * density(step) / normalizer,
             sigma_m, weight.is_at_rest, &obstacle},
            seen.stamp);
      }
    }
  }
}

void LocalObstacleMap::forgetFree(const GroundArea& is_unwatched) {
  const RigidTransform vehicle_from_fixed = fixed_from_vehicle_.inverse();
  const double cell_m = options_.cell_size_m;
  for (int64_t y = cells_.firstY(); y < cells_.firstY() + cells_.size(); ++y) {
    for (int64_t x = cells_.firstX(); x < cells_.firstX() + cells_.size(); ++x) {
      Cell& cell = cells_.at(x, y);
      if ((cell.log_odds < 0.0F || cell.lost_ns != kNever) &&
          is_unwatched(transformed(vehicle_from_fixed, {(x + 0.5) * cell_m, (y + 0.5) * cell_m}))) {
        cell.log_odds = std::max(cell.log_odds, 0.0F);
        cell.lost_ns = kNever;
      }
    }
  }
}

void LocalObstacleMap::forgetAround(const Eigen::Vector2d& point_m, Timestamp first, Timestamp last) {
  hold(cells_.indexOf(point_m.x()), cells_.indexOf(point_m.y()), options_.changed_margin_m, first, last);
}

int8_t LocalObstacleMap::stateOf(const Cell& cell) const {
  if (occupiedLogOdds(cell) >= static_cast<float>(options_.occupied_threshold)) {
    return kCellOccupied;
  }
  return cell.log_odds <= static_cast<float>(options_.free_threshold) ? kCellFree : kCellUnobserved;
}

void LocalObstacleMap::reanchor(const RigidTransform& new_from_old_fixed) {
  if (!has_pose_) {
    return;
  }
  const RigidTransform new_from_old = levelled(new_from_old_fixed);
  const RigidTransform old_from_new = new_from_old.inverse();
  LocalObstacleMap moved(options_);
  moved.moveTo(stamp_, new_from_old * fixed_from_vehicle_);
  const double cell_m = options_.cell_size_m;
  moved.cells_.forEach([&](int64_t x, int64_t y, const Cell& /*unset*/) {
    const Eigen::Vector2d point_m =
        transformed(old_from_new, Eigen::Vector2d((x + 0.5) * cell_m, (y + 0.5) * cell_m));
    const int64_t old_x = cells_.indexOf(point_m.x());
    const int64_t old_y = cells_.indexOf(point_m.y());
    if (cells_.isInside(old_x, old_y) && occupiedLogOdds(cells_.at(old_x, old_y)) <= 0.0F) {
      moved.cells_.at(x, y) = cells_.at(old_x, old_y);
    }
  });
  // Obstacles move with their points, so that none falls between two cells.
  cells_.forEach([&](int64_t x, int64_t y, const Cell& old) {
    const Eigen::Vector2d point_m =
        transformed(new_from_old, Eigen::Vector2d(x * cell_m + old.x_m, y * cell_m + old.y_m));
    const int64_t new_x = cells_.indexOf(point_m.x());
    const int64_t new_y = cells_.indexOf(point_m.y());
    if (occupiedLogOdds(old) <= 0.0F || !moved.cells_.isInside(new_x, new_y)) {
      return;
    }
    Cell& target = moved.cells_.at(new_x, new_y);
    if (occupiedLogOdds(old) > occupiedLogOdds(target)) {
      target = old;
      target.x_m = static_cast<float>(point_m.x() - static_cast<double>(new_x) * cell_m);
      target.y_m = static_cast<float>(point_m.y() - static_cast<double>(new_y) * cell_m);
    }
  });
  moved.travel_m_ = travel_m_;
  moved.travel_direction_ =
      (new_from_old.rotation() * Eigen::Vector3d(travel_direction_.x(), travel_direction_.y(), 0.0))
          .head<2>();
  moved.last_at_rest_ = last_at_rest_;
  for (const auto& [name, position] : last_camera_position_) {
    moved.last_camera_position_[name] = transformed(new_from_old, position);
  }
  *this = moved;
}

}  // namespace vcharge
