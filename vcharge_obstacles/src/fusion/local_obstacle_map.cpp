#include "vcharge_obstacles/local_obstacle_map.h"

#include <algorithm>
#include <cmath>
#include <limits>

#include "fusion/cell_look.h"
#include "ground/ground_shadows.h"
#include "vcharge_core/base/error.h"
#include "vcharge_obstacles/map_scan.h"

namespace vcharge {
namespace {

// A look's place counts so much more than those before it, so that a cell follows the odometry's drift.
constexpr float kMemory = 0.9F;
// A look speaks for so many sigmas of its range to both sides: further away it rather says that nothing is.
constexpr double kLookSigmas = 1.0;

RigidTransform levelled(const RigidTransform& transform) {
  return RigidTransform::planar(transform.translation().x(), transform.translation().y(),
                                yawOfRotation(transform.rotation()));
}

Eigen::Vector2d transformed(const RigidTransform& transform, const Eigen::Vector2d& point_m) {
  return (transform * Eigen::Vector3d(point_m.x(), point_m.y(), 0.0)).head<2>();
}

}  // namespace

void LocalObstacleMapOptions::validate() const {
  requireField(cell_size_m >= 0.01 && cell_size_m <= 1.0, "cell_size_m", "must be in [0.01, 1]", cell_size_m);
  requireField(half_size_m >= 5.0 * cell_size_m && half_size_m <= 2000.0 * cell_size_m, "half_size_m",
               "must be 5 to 2000 cells", half_size_m);
  requireField(free_range_m > 0.0, "free_range_m", "must be positive", free_range_m);
  requireField(occupied_range_m > 0.0, "occupied_range_m", "must be positive", occupied_range_m);
  requireField(occupied_log_odds > 0.0, "occupied_log_odds", "must be positive", occupied_log_odds);
  requireField(sharp_sigma_m > 0.0, "sharp_sigma_m", "must be positive", sharp_sigma_m);
  requireField(free_log_odds > 0.0, "free_log_odds", "must be positive", free_log_odds);
  requireField(min_free_share > 0.0 && min_free_share <= 1.0, "min_free_share", "must be in (0, 1]",
               min_free_share);
  requireField(min_hidden_share > 0.0 && min_hidden_share <= 1.0, "min_hidden_share", "must be in (0, 1]",
               min_hidden_share);
  requireField(min_changed_share > 0.0, "min_changed_share", "must be positive", min_changed_share);
  requireField(changed_margin_m >= 0.0, "changed_margin_m", "must not be negative", changed_margin_m);
  requireField(changed_hold_s >= 0.0, "changed_hold_s", "must not be negative", changed_hold_s);
  requireField(doubt >= 0.0 && doubt <= 1.0, "doubt", "must be in [0, 1]", doubt);
  requireField(unknown_doubt >= 0.0 && unknown_doubt <= 1.0, "unknown_doubt", "must be in [0, 1]",
               unknown_doubt);
  requireField(shadow_s >= 0.0, "shadow_s", "must not be negative", shadow_s);
  requireField(blind_angle_rad >= 0.0, "blind_angle_rad", "must not be negative", blind_angle_rad);
  requireField(parallax_sigma >= 0.0, "parallax_sigma", "must not be negative", parallax_sigma);
  requireField(look_distance_m > 0.0, "look_distance_m", "must be positive", look_distance_m);
  requireField(occupied_threshold > 0.0, "occupied_threshold", "must be positive", occupied_threshold);
  requireField(free_threshold < 0.0, "free_threshold", "must be negative", free_threshold);
  requireField(max_log_odds > occupied_threshold, "max_log_odds", "must be above occupied_threshold",
               max_log_odds);
  requireField(min_log_odds < free_threshold, "min_log_odds", "must be below free_threshold", min_log_odds);
  requireField(forget_occupied_m > 0.0, "forget_occupied_m", "must be positive", forget_occupied_m);
  requireField(forget_free_m > 0.0, "forget_free_m", "must be positive", forget_free_m);
  requireField(odometry_sigma_m_per_m >= 0.0, "odometry_sigma_m_per_m", "must not be negative",
               odometry_sigma_m_per_m);
  requireField(scan_depth_m >= 0.0, "scan_depth_m", "must not be negative", scan_depth_m);
  requireField(scan_rays >= 8, "scan_rays", "must be at least 8", scan_rays);
}

LocalObstacleMap::LocalObstacleMap(const LocalObstacleMapOptions& options)
    : options_((options.validate(), options)),
      cells_(2 * static_cast<int>(std::lround(options.half_size_m / options.cell_size_m)),
             options.cell_size_m) {}

void LocalObstacleMap::clear() {
  cells_.clear();
  last_camera_position_.clear();
}

void LocalObstacleMap::forget(double travelled_m) {
  const auto keep_occupied = static_cast<float>(std::exp(-travelled_m / options_.forget_occupied_m));
  const auto keep_free = static_cast<float>(std::exp(-travelled_m / options_.forget_free_m));
  for (Cell& cell : cells_.cells()) {
    cell.log_odds *= cell.log_odds > 0.0F ? keep_occupied : keep_free;
  }
}

void LocalObstacleMap::moveTo(Timestamp stamp, const RigidTransform& fixed_from_vehicle) {
  const RigidTransform level = levelled(fixed_from_vehicle);
  const int64_t first_x = cells_.indexOf(level.translation().x()) - cells_.size() / 2;
  const int64_t first_y = cells_.indexOf(level.translation().y()) - cells_.size() / 2;
  if (placed_) {
    const double travelled_m = (level.translation() - fixed_from_vehicle_.translation()).norm();
    if (travelled_m > 0.0) {
      forget(travelled_m);
      travel_direction_ = (level.translation() - fixed_from_vehicle_.translation()).head<2>().normalized();
      travel_m_ += travelled_m;
    }
  }
  cells_.moveTo(first_x, first_y);
  placed_ = true;
  stamp_ = stamp;
  fixed_from_vehicle_ = level;
}

void LocalObstacleMap::add(const CameraObstacles& seen, const PolarGrid& grid,
                           const RigidTransform& fixed_from_vehicle) {
  check(placed_, "LocalObstacleMap::add: moveTo() comes first");
  const RigidTransform level = levelled(fixed_from_vehicle);
  const double weight = weightOf(seen, level);
  addGround(seen, grid, level, weight);
  addOccupied(seen, grid, level, weight);
}

/// Range maps from nearly the same place are of nearly the same images, and wrong together.
double LocalObstacleMap::weightOf(const CameraObstacles& seen, const RigidTransform& fixed_from_vehicle) {
  const Eigen::Vector2d position = transformed(fixed_from_vehicle, seen.origin_m);
  const auto [last, is_first] = last_camera_position_.try_emplace(seen.camera_name, position);
  const double moved_m = (position - last->second).norm();
  last->second = position;
  return is_first ? 1.0 : std::min(1.0, moved_m / options_.look_distance_m);
}

struct LocalObstacleMap::GroundLook {
  int64_t x, y;  // of the cell
  CellLook look;
  bool in_shadow;  // of what other looks have found before it
  bool may_free;   // seen near enough to the camera's axis
  bool explained;  // a change of its looks, by something that stands there
};

GroundShadows LocalObstacleMap::shadowsFor(const CameraObstacles& seen,
                                           const Eigen::Vector2d& camera_m) const {
  GroundShadows shadows(seen.camera_height_m);
  const double cell_m = options_.cell_size_m;
  const int64_t since_ns = (seen.stamp - durationFromSeconds(options_.shadow_s)).nanoseconds();
  for (int64_t y = cells_.firstY(); y < cells_.firstY() + cells_.size(); ++y) {
    for (int64_t x = cells_.firstX(); x < cells_.firstX() + cells_.size(); ++x) {
      const Cell& cell = cells_.at(x, y);
      if (cell.last_occupied_ns > since_ns && stateOf(cell) == kCellOccupied) {
        const Eigen::Vector2d middle_m((x + 0.5) * cell_m, (y + 0.5) * cell_m);
        shadows.add(middle_m - camera_m, cell_m, cell.height_m);
      }
    }
  }
  return shadows;
}

std::vector<LocalObstacleMap::GroundLook> LocalObstacleMap::lookAtGround(
    const CameraObstacles& seen, const CellLooker& looker, const PolarGrid& grid,
    const RigidTransform& fixed_from_vehicle) const {
  const double cell_m = options_.cell_size_m;
  const double blind_sine = std::sin(options_.blind_angle_rad);
  const Eigen::Vector2d camera_m = transformed(fixed_from_vehicle, seen.origin_m);
  const double yaw_rad = yawOfRotation(fixed_from_vehicle.rotation());
  const GroundShadows shadows = shadowsFor(seen, camera_m);
  const auto reach = static_cast<int64_t>(std::ceil(options_.free_range_m / cell_m));
  const int64_t middle_x = cells_.indexOf(camera_m.x());
  const int64_t middle_y = cells_.indexOf(camera_m.y());
  std::vector<GroundLook> looks;
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
      const bool has_changed = !seen.changed_share.empty() && seen.changed_share[index] > 0.0F;
      if (seen.free_share[index] <= 0.0F && seen.hidden_share[index] <= 0.0F &&
          seen.unknown_share[index] <= 0.0F && !has_changed) {
        continue;
      }
      CellLook look = looker.look(angle_rad, range_m, bin);
      const double across_m =
          std::abs(offset_m.x() * travel_direction_.y() - offset_m.y() * travel_direction_.x());
      if (across_m <= blind_sine * range_m) {
        look.unknown_share = 0.0;  // also before the first motion
      }
      const bool explained =
          look.changed_share >= options_.min_changed_share && looker.isExplained(angle_rad, range_m);
      const bool may_free = seen.free_to_m.empty() || range_m <= seen.free_to_m[static_cast<size_t>(ray)];
      looks.push_back({x, y, look, shadows.hides(offset_m), may_free, explained});
    }
  }
  return looks;
}

void LocalObstacleMap::addGround(const CameraObstacles& seen, const PolarGrid& grid,
                                 const RigidTransform& fixed_from_vehicle, double weight) {
  const std::vector<GroundLook> looks =
      lookAtGround(seen, CellLooker(seen, grid, options_.cell_size_m), grid, fixed_from_vehicle);
  holdChanged(looks, seen.stamp);
  for (const GroundLook& ground : looks) {
    addGroundLook(ground, weight, seen.stamp);
  }
}

/// Takes back what was free where the ground looks otherwise than before, and around it.
void LocalObstacleMap::holdChanged(const std::vector<GroundLook>& looks, Timestamp stamp) {
  for (const GroundLook& ground : looks) {
    if (ground.look.changed_share >= options_.min_changed_share) {
      hold(ground.x, ground.y, ground.explained ? 0.0 : options_.changed_margin_m, stamp);
    }
  }
}

void LocalObstacleMap::hold(int64_t x, int64_t y, double radius_m, Timestamp stamp) {
  const int64_t until_ns = (stamp + durationFromSeconds(options_.changed_hold_s)).nanoseconds();
  const double radius = radius_m / options_.cell_size_m;
  const auto reach = static_cast<int64_t>(radius);
  for (int64_t row = y - reach; row <= y + reach; ++row) {
    for (int64_t column = x - reach; column <= x + reach; ++column) {
      const double distance = std::hypot(static_cast<double>(row - y), static_cast<double>(column - x));
      if (distance <= radius && cells_.isInside(column, row)) {
        Cell& cell = cells_.at(column, row);
        cell.held_until_ns = std::max(cell.held_until_ns, until_ns);
        cell.log_odds = std::max(cell.log_odds, 0.0F);
      }
    }
  }
}

void LocalObstacleMap::addGroundLook(const GroundLook& ground, double weight, Timestamp stamp) {
  const CellLook& look = ground.look;
  Cell* cell = &cells_.at(ground.x, ground.y);
  const bool shows_ground = !look.blocked && look.free_share >= options_.min_free_share;
  if (shows_ground && !ground.in_shadow) {
    const double log_odds = cell->log_odds - weight * options_.free_log_odds * look.free_share;
    const bool may_free =
        stamp.nanoseconds() >= cell->held_until_ns && (ground.may_free || stateOf(*cell) == kCellFree);
    const double least =
        may_free ? options_.min_log_odds : std::min(0.0, static_cast<double>(cell->log_odds));
    cell->log_odds = static_cast<float>(std::max(least, log_odds));
    cell->last_seen_ns = stamp.nanoseconds();
    cell->travel_m = static_cast<float>(travel_m_);
  } else if (cell->log_odds < 0.0F &&
             (shows_ground || look.hidden_share + look.unknown_share >= options_.min_hidden_share)) {
    // That it was free once is no longer sure: something stands there now, or before it, or cannot be told.
    const bool hides = shows_ground || look.hidden_share >= look.unknown_share;
    cell->log_odds *= static_cast<float>(std::pow(hides ? options_.doubt : options_.unknown_doubt, weight));
  }
}

void LocalObstacleMap::addLook(const Look& look, Timestamp stamp) {
  const int64_t x = cells_.indexOf(look.point_m.x());
  const int64_t y = cells_.indexOf(look.point_m.y());
  if (!cells_.isInside(x, y) || look.mass <= 0.0) {
    return;
  }
  Cell& cell = cells_.at(x, y);
  cell.log_odds = std::min(static_cast<float>(options_.max_log_odds),
                           cell.log_odds + static_cast<float>(options_.occupied_log_odds * look.mass));
  const double sigma_m = look.sigma_m;
  const auto weight = static_cast<float>(look.mass / (sigma_m * sigma_m + 1e-4));
  const float kept = kMemory * cell.weight;
  const float share = weight / (kept + weight);
  const auto blend = [share](float* mean, double value) {
    *mean += share * (static_cast<float>(value) - *mean);
  };
  cell.weight = kept + weight;
  blend(&cell.x_m, look.point_m.x() - static_cast<double>(x) * options_.cell_size_m);
  blend(&cell.y_m, look.point_m.y() - static_cast<double>(y) * options_.cell_size_m);
  blend(&cell.sigma_m, sigma_m);
  blend(&cell.height_m, look.obstacle->height_m);
  blend(&cell.height_sigma_m, look.obstacle->height_sigma_m);
  cell.travel_m = static_cast<float>(travel_m_);
  cell.last_seen_ns = cell.last_occupied_ns = stamp.nanoseconds();
}

/// Standard deviation of a range by the error across the ray of how the camera moved. Directions are in the
/// fixed frame; before the first motion nothing is known.
double LocalObstacleMap::parallaxSigma_m(double range_m, const Eigen::Vector2d& direction) const {
  constexpr double kLeastSine = 0.03;
  const double across =
      std::abs(direction.x() * travel_direction_.y() - direction.y() * travel_direction_.x());
  const double along = std::abs(direction.dot(travel_direction_));
  return options_.parallax_sigma * range_m * along / std::max(across, kLeastSine);
}

void LocalObstacleMap::addOccupied(const CameraObstacles& seen, const PolarGrid& grid,
                                   const RigidTransform& fixed_from_vehicle, double weight) {
  const double cell_m = options_.cell_size_m;
  const double yaw_rad = yawOfRotation(fixed_from_vehicle.rotation());
  for (const PolarObstacle& obstacle : seen.obstacles) {
    if (obstacle.is_off_axis || obstacle.range_m > options_.occupied_range_m) {
      continue;
    }
    const double width_m = obstacle.range_m * grid.increment_rad();
    const int across = std::max(1, static_cast<int>(std::ceil(width_m / cell_m)));
    // Several rays meet one cell nearby: together they are one look.
    const double ray_mass =
        weight * obstacle.weight * std::min(1.0, width_m / cell_m * 1.5) * std::max(0.3, obstacle.support);
    const double middle_rad = grid.angle_rad(obstacle.ray) + yaw_rad;
    const double sigma_m =
        std::hypot(obstacle.range_sigma_m,
                   parallaxSigma_m(obstacle.range_m, {std::cos(middle_rad), std::sin(middle_rad)}));
    const double sharpness = std::min(1.0, options_.sharp_sigma_m / sigma_m);
    const double look_mass = sharpness * sharpness * ray_mass;
    const int along =
        sigma_m < 0.6 * cell_m ? 0 : static_cast<int>(std::ceil(kLookSigmas * sigma_m / cell_m));
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
        addLook({transformed(fixed_from_vehicle, point_in_vehicle), look_mass * density(step) / normalizer,
                 sigma_m, &obstacle},
                seen.stamp);
      }
    }
  }
}

int8_t LocalObstacleMap::stateOf(const Cell& cell) const {
  if (cell.log_odds >= static_cast<float>(options_.occupied_threshold)) {
    return kCellOccupied;
  }
  return cell.log_odds <= static_cast<float>(options_.free_threshold) ? kCellFree : kCellUnobserved;
}

void LocalObstacleMap::reanchor(const RigidTransform& new_from_old_fixed) {
  if (!placed_) {
    return;
  }
  const RigidTransform new_from_old = levelled(new_from_old_fixed);
  const RigidTransform old_from_new = new_from_old.inverse();
  LocalObstacleMap moved(options_);
  moved.moveTo(stamp_, new_from_old * fixed_from_vehicle_);
  const double cell_m = options_.cell_size_m;
  const auto oldCell = [&](int64_t x, int64_t y) -> const Cell* {
    const Eigen::Vector2d place =
        transformed(old_from_new, Eigen::Vector2d((x + 0.5) * cell_m, (y + 0.5) * cell_m));
    const int64_t old_x = cells_.indexOf(place.x());
    const int64_t old_y = cells_.indexOf(place.y());
    return cells_.isInside(old_x, old_y) ? &cells_.at(old_x, old_y) : nullptr;
  };
  for (int64_t y = moved.cells_.firstY(); y < moved.cells_.firstY() + cells_.size(); ++y) {
    for (int64_t x = moved.cells_.firstX(); x < moved.cells_.firstX() + cells_.size(); ++x) {
      const Cell* old = oldCell(x, y);
      if (old != nullptr && old->log_odds <= 0.0F) {
        moved.cells_.at(x, y) = *old;
      }
    }
  }
  // Obstacles go where their points go, so that none falls between two cells.
  for (int64_t y = cells_.firstY(); y < cells_.firstY() + cells_.size(); ++y) {
    for (int64_t x = cells_.firstX(); x < cells_.firstX() + cells_.size(); ++x) {
      const Cell& old = cells_.at(x, y);
      const Eigen::Vector2d place =
          transformed(new_from_old, Eigen::Vector2d(x * cell_m + old.x_m, y * cell_m + old.y_m));
      const int64_t new_x = cells_.indexOf(place.x());
      const int64_t new_y = cells_.indexOf(place.y());
      if (old.log_odds <= 0.0F || !moved.cells_.isInside(new_x, new_y)) {
        continue;
      }
      Cell& target = moved.cells_.at(new_x, new_y);
      if (old.log_odds > target.log_odds) {
        target = old;
        target.x_m = static_cast<float>(place.x() - static_cast<double>(new_x) * cell_m);
        target.y_m = static_cast<float>(place.y() - static_cast<double>(new_y) * cell_m);
      }
    }
  }
  moved.travel_m_ = travel_m_;
  moved.travel_direction_ =
      (new_from_old.rotation() * Eigen::Vector3d(travel_direction_.x(), travel_direction_.y(), 0.0))
          .head<2>();
  for (const auto& [name, position] : last_camera_position_) {
    moved.last_camera_position_[name] = transformed(new_from_old, position);
  }
  *this = moved;
}

ObstacleMap LocalObstacleMap::snapshot() const {
  ObstacleMap map = ObstacleMap::unobserved({cells_.size(), cells_.size()}, options_.cell_size_m);
  map.stamp = stamp_;
  map.fixed_from_vehicle = fixed_from_vehicle_;
  map.origin_m = options_.cell_size_m *
                 Eigen::Vector2d(static_cast<double>(cells_.firstX()), static_cast<double>(cells_.firstY()));
  for (int row = 0; row < cells_.size(); ++row) {
    for (int column = 0; column < cells_.size(); ++column) {
      const Cell& cell = cells_.at(cells_.firstX() + column, cells_.firstY() + row);
      if (cell.last_seen_ns == kNever) {
        continue;
      }
      map.age_s.at<float>(row, column) =
          static_cast<float>(static_cast<double>(stamp_.nanoseconds() - cell.last_seen_ns) * 1e-9);
      const int8_t state = stateOf(cell);
      map.state.at<int8_t>(row, column) = state;
      if (state == kCellOccupied) {
        const auto drift_m =
            static_cast<float>((travel_m_ - cell.travel_m) * options_.odometry_sigma_m_per_m);
        const auto cell_m = static_cast<float>(options_.cell_size_m);
        map.point_m.at<cv::Vec2f>(row, column) = {static_cast<float>(column) * cell_m + cell.x_m,
                                                  static_cast<float>(row) * cell_m + cell.y_m};
        map.point_sigma_m.at<float>(row, column) = std::hypot(cell.sigma_m, drift_m);
        map.height_m.at<float>(row, column) = cell.height_m;
        map.height_sigma_m.at<float>(row, column) = cell.height_sigma_m;
      }
    }
  }
  return map;
}

ObstacleScan LocalObstacleMap::scan() const {
  return makeScan(snapshot(), options_.scan_rays, options_.scan_depth_m);
}

}  // namespace vcharge
