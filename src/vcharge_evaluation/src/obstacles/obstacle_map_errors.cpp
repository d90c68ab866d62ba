#include "vcharge_evaluation/obstacle_map_errors.h"

#include <algorithm>
#include <cmath>
#include <limits>

#include <opencv2/imgproc.hpp>

#include "vcharge_core/base/options.h"

namespace vcharge {
namespace {

constexpr double kKerbStep_m = 0.1;
constexpr double kWheelbase_m = 2.6;
// Half the vehicle's length before the rear axle: its middle.
constexpr double kMiddle_m = 1.4;
// Seen points from here up belong to an obstacle.
constexpr double kSeenHeight_m = 0.1;
constexpr double kMaxHeight_m = 2.0;
constexpr double kKerbTolerance_m = 0.15;
constexpr double kKerbWidth_m = 0.2;

/// From the ground between the wheels, over all poses.
double distanceFromPath(const std::vector<Eigen::Vector2d>& points_m, const std::vector<RigidTransform>& path,
                        double half_width_m) {
  double nearest = std::numeric_limits<double>::infinity();
  for (const RigidTransform& pose : path) {
    for (const double x : {0.0, kWheelbase_m}) {
      const Eigen::Vector2d axle = (pose * Eigen::Vector3d(x, 0.0, 0.0)).head<2>();
      for (const Eigen::Vector2d& point : points_m) {
        nearest = std::min(nearest, (point - axle).norm());
      }
    }
  }
  return std::max(0.0, nearest - half_width_m);
}

cv::Mat withoutNaN(const cv::Mat& image) {
  cv::Mat known = image.clone();
  cv::patchNaNs(known, 0.0);
  return known;
}

/// False for what is surely further from a place.
bool isNear(const TruthObstacle& obstacle, const Eigen::Vector2d& place_m, double distance_m) {
  return (obstacle.middle_m() - place_m).norm() <= distance_m + obstacle.width_m();
}

/// An occupied cell as the world has it.
struct OccupiedCell {
  Eigen::Vector2d world_m;
  double height_m;
};

}  // namespace

struct ObstacleMapEvaluator::Frame {
  const ObstacleMap& map;
  RigidTransform world_from_fixed;
  Eigen::Vector2d vehicle_middle_m;
  std::vector<OccupiedCell> occupied;
  SeenCells seen_high, seen_low;  // surfaces aside of the travel, within the view range
  const std::vector<TruthObstacle>& movers;
  const std::vector<TruthObstacle>& earlier_movers;

  Eigen::Vector2d fixedOf(int column, int row) const {
    return map.origin_m + map.cell_size_m * Eigen::Vector2d(column + 0.5, row + 0.5);
  }
  Eigen::Vector2d worldOf(int column, int row) const {
    const Eigen::Vector2d fixed = fixedOf(column, row);
    return (world_from_fixed * Eigen::Vector3d(fixed.x(), fixed.y(), 0.0)).head<2>();
  }
  int seenPointsOf(const TruthObstacle& obstacle) const {
    int sum = 0;
    for (const auto& [key, count] : seen_high.counts()) {
      sum +=
          distanceToPolygon(SeenCells::middleOf(key), obstacle.footprint_m) < SeenCells::kCell_m ? count : 0;
    }
    return sum;
  }
  bool reports(const TruthObstacle& obstacle, double tolerance_m) const {
    return std::any_of(occupied.begin(), occupied.end(), [&](const OccupiedCell& cell) {
      return distanceToPolygon(cell.world_m, obstacle.footprint_m) <= tolerance_m;
    });
  }
};

void ObstacleMapEvaluationOptions::validate() const {
  for (const auto& [name, value] : {std::pair("min_height_m", min_height_m),
                                    {"min_width_m", min_width_m},
                                    {"corridor_m", corridor_m},
                                    {"view_range_m", view_range_m},
                                    {"tolerance_m", tolerance_m},
                                    {"false_radius_m", false_radius_m},
                                    {"false_height_m", false_height_m},
                                    {"false_range_m", false_range_m}}) {
    requireField(value > 0.0, name, "must be positive", value);
  }
  requireField(grace_m >= 0.0, "grace_m", "must not be negative", grace_m);
  requireField(min_seen_points > 0, "min_seen_points", "must be positive", min_seen_points);
  requireField(kerb_max_m > kerb_min_m, "kerb_max_m", "must be above kerb_min_m", kerb_max_m);
}

ObstacleMapEvaluator::ObstacleMapEvaluator(const std::vector<TruthObstacle>& obstacles,
                                           const TruthHeights& heights,
                                           const std::vector<RigidTransform>& path,
                                           const ObstacleMapEvaluationOptions& options)
    : options_(options), heights_(heights) {
  options_.validate();
  const cv::Mat known = withoutNaN(heights.height_m);
  const auto highestWithin = [&](double radius_m) {
    const int side = 2 * static_cast<int>(std::lround(radius_m / heights.cell_size_m)) + 1;
    cv::Mat highest;
    cv::dilate(known, highest, cv::getStructuringElement(cv::MORPH_ELLIPSE, {side, side}));
    return highest;
  };
  highest_around_ = highestWithin(options_.false_radius_m);
  const cv::Mat highest_on_kerbs = highestWithin(kKerbWidth_m);
  cv::erode(known, lowest_around_, cv::getStructuringElement(cv::MORPH_RECT, {3, 3}));
  for (const TruthObstacle& obstacle : obstacles) {
    if (obstacle.top_z_m >= options_.false_height_m && obstacle.base_z_m < kMaxHeight_m) {
      standing_.push_back(obstacle);
    }
    std::vector<Eigen::Vector2d> outline = obstacle.footprint_m;
    if (obstacle.kind == "kerb") {
      addKerbPoints(obstacle, highest_on_kerbs, path);
    }
    for (size_t i = 0; i < obstacle.footprint_m.size(); ++i) {  // long walls have their corners far away
      const Eigen::Vector2d& a = obstacle.footprint_m[i];
      const Eigen::Vector2d& b = obstacle.footprint_m[(i + 1) % obstacle.footprint_m.size()];
      for (double share = 0.1; share < 0.95; share += 0.1) {
        outline.push_back(a + share * (b - a));
      }
    }
    const double distance_m = distanceFromPath(outline, path, options_.vehicle_half_width_m);
    if (obstacle.height_m() >= options_.min_height_m && obstacle.width_m() >= options_.min_width_m &&
        obstacle.base_z_m < kMaxHeight_m && distance_m <= options_.corridor_m) {
      Tracked tracked{obstacle, distance_m, std::nullopt, false, {}};
      tracked.outcome = {obstacle.kind, obstacle.middle_m(), obstacle.height_m(), obstacle.width_m(),
                         distance_m};
      tracked_.push_back(tracked);
    }
  }
}

void ObstacleMapEvaluator::addKerbPoints(const TruthObstacle& kerb, const cv::Mat& highest_m,
                                         const std::vector<RigidTransform>& path) {
  for (size_t i = 0; i < kerb.footprint_m.size(); ++i) {
    const Eigen::Vector2d& a = kerb.footprint_m[i];
    const Eigen::Vector2d& b = kerb.footprint_m[(i + 1) % kerb.footprint_m.size()];
    const int steps = static_cast<int>((b - a).norm() / kKerbStep_m);
    for (int step = 0; step < steps; ++step) {
      const Eigen::Vector2d point = a + (step + 0.5) / steps * (b - a);
      // Grass and bushes on the island hide what the kerb itself rises to.
      const double height_m = heights_.at(highest_m, point);
      if (height_m >= options_.kerb_min_m && height_m <= options_.kerb_max_m &&
          distanceFromPath({point}, path, options_.vehicle_half_width_m) <= options_.corridor_m) {
        KerbOutcome outcome;
        outcome.place_m = point;
        outcome.nearest_m = std::numeric_limits<double>::infinity();
        kerb_points_.push_back({height_m, std::nullopt, false, outcome});
      }
    }
  }
}

void ObstacleMapEvaluator::add(const ObstacleMap& map, const std::vector<SeenPoint>& points,
                               const RigidTransform& world_from_vehicle,
                               const std::vector<TruthObstacle>& movers,
                               const std::vector<TruthObstacle>& earlier_movers) {
  const Eigen::Vector2d position = world_from_vehicle.translation().head<2>();
  driven_m_ += last_position_m_ ? (position - *last_position_m_).norm() : 0.0;
  last_position_m_ = position;
  ++num_frames_;
  const RigidTransform level =
      RigidTransform::planar(position.x(), position.y(), yawOfRotation(world_from_vehicle.rotation()));
  Frame frame{map,
              level * map.fixed_from_vehicle.inverse(),
              (level * Eigen::Vector3d(kMiddle_m, 0.0, 0.0)).head<2>(),
              {},
              {},
              {},
              movers,
              earlier_movers};
  for (int row = 0; row < map.state.rows; ++row) {
    for (int column = 0; column < map.state.cols; ++column) {
      if (map.state.at<int8_t>(row, column) == kCellOccupied) {
        frame.occupied.push_back({frame.worldOf(column, row), map.height_m.at<float>(row, column)});
      }
    }
  }
  for (const SeenPoint& point : points) {
    const Eigen::Vector2d place = point.world_m.head<2>().cast<double>();
    const double height_m = point.world_m.z();
    if (height_m < options_.false_height_m &&
        (place - frame.vehicle_middle_m).norm() <= options_.false_range_m) {
      seen_ground_.add(place);
    }
    if (point.from_travel_rad < options_.min_angle_from_travel_rad ||
        (place - frame.vehicle_middle_m).norm() > options_.view_range_m) {
      continue;
    }
    if (height_m >= kSeenHeight_m && height_m <= kMaxHeight_m) {
      frame.seen_high.add(place);
    }
    if (height_m >= 0.04 && height_m <= options_.kerb_max_m) {
      frame.seen_low.add(place);
    }
  }
  judgeObstacles(frame);
  judgeKerbs(frame);
  judgeCells(frame);
  judgeMovers(frame);
}

void ObstacleMapEvaluator::judgeObstacles(const Frame& frame) {
  for (Tracked& tracked : tracked_) {
    if (!isNear(tracked.obstacle, frame.vehicle_middle_m, options_.view_range_m + 1.0) ||
        frame.seenPointsOf(tracked.obstacle) < options_.min_seen_points) {
      continue;
    }
    if (!tracked.first_view_m) {
      tracked.first_view_m = driven_m_;
    }
    if (driven_m_ < *tracked.first_view_m + options_.grace_m) {
      continue;
    }
    const bool reported = frame.reports(tracked.obstacle, options_.tolerance_m);
    if (!tracked.judged) {
      tracked.judged = true;
      tracked.outcome.reported = reported;
    }
    ++tracked.outcome.frames;
    tracked.outcome.frames_reported += reported ? 1 : 0;
  }
}

/// Of the occupied cell that reports the place.
std::optional<double> ObstacleMapEvaluator::kerbHeightError(const Frame& frame, const KerbPoint& point) {
  std::optional<double> error_m;
  double nearest_m = kKerbTolerance_m;
  for (const OccupiedCell& cell : frame.occupied) {
    const double distance_m = (cell.world_m - point.outcome.place_m).norm();
    if (distance_m <= nearest_m) {
      nearest_m = distance_m;
      error_m = std::abs(cell.height_m - point.height_m);
    }
  }
  return error_m;
}

void ObstacleMapEvaluator::judgeKerbs(const Frame& frame) {
  for (KerbPoint& point : kerb_points_) {
    KerbOutcome& outcome = point.outcome;
    const double distance_m = (outcome.place_m - frame.vehicle_middle_m).norm();
    if (!point.first_view_m && frame.seen_low.countAround(outcome.place_m) >= options_.min_seen_points) {
      point.first_view_m = driven_m_;
    }
    if (!point.first_view_m) {
      continue;
    }
    outcome.nearest_m = std::min(outcome.nearest_m, distance_m);
    const bool is_due = !point.judged && driven_m_ >= *point.first_view_m + options_.grace_m;
    if (!is_due && (outcome.ever_reported || distance_m > options_.view_range_m)) {
      continue;
    }
    const std::optional<double> height_error_m = kerbHeightError(frame, point);
    if (is_due) {
      point.judged = true;
      outcome.reported = height_error_m.has_value();
      outcome.height_error_m = height_error_m.value_or(0.0);
    }
    outcome.ever_reported = outcome.ever_reported || height_error_m;
  }
}

void ObstacleMapEvaluator::judgeCells(const Frame& frame) {
  const ObstacleMap& map = frame.map;
  const auto isNearMover = [&](const Eigen::Vector2d& place) {
    return std::any_of(frame.earlier_movers.begin(), frame.earlier_movers.end(),
                       [&](const TruthObstacle& mover) {
                         return distanceToPolygon(place, mover.footprint_m) <= options_.tolerance_m;
                       });
  };
  std::vector<TruthObstacle> nearby;
  std::copy_if(standing_.begin(), standing_.end(), std::back_inserter(nearby),
               [&](const TruthObstacle& obstacle) {
                 return isNear(obstacle, frame.vehicle_middle_m, options_.false_range_m + 1.0);
               });
  // Posts may stand between the cells of the height map.
  const auto isNearObstacle = [&](const Eigen::Vector2d& place) {
    return std::any_of(nearby.begin(), nearby.end(), [&](const TruthObstacle& obstacle) {
      return distanceToPolygon(place, obstacle.footprint_m) <= options_.false_radius_m;
    });
  };
  for (int row = 0; row < map.state.rows; ++row) {
    for (int column = 0; column < map.state.cols; ++column) {
      const int8_t state = map.state.at<int8_t>(row, column);
      const int64_t fixed_key = SeenCells::keyOf(frame.fixedOf(column, row));
      const auto known = false_cells_.find(fixed_key);
      if (known != false_cells_.end() && state != kCellOccupied) {
        known->second.is_left = false;
      }
      const Eigen::Vector2d place = frame.worldOf(column, row);
      if (state == kCellUnobserved || (place - frame.vehicle_middle_m).norm() > options_.false_range_m) {
        continue;
      }
      const int64_t key = SeenCells::keyOf(place);
      if (heights_.at(lowest_around_, place) >= 0.2F) {
        observed_inside_.insert(key);
        if (state == kCellFree) {
          free_inside_.insert(key);
        }
      } else if (state == kCellOccupied && !isNearMover(place) && !isNearObstacle(place) &&
                 heights_.at(highest_around_, place) < static_cast<float>(options_.false_height_m)) {
        addFalseCell(frame, fixed_key, place);
      }
    }
  }
}

void ObstacleMapEvaluator::addFalseCell(const Frame& frame, int64_t key, const Eigen::Vector2d& place_m) {
  const auto [entry, is_new] = false_cells_.try_emplace(key);
  FalseCell& cell = entry->second;
  if (is_new) {
    cell.world_m = place_m;
    cell.first_seen = frame.map.stamp;
  }
  ++cell.frames;
  cell.is_left = true;
}

void ObstacleMapEvaluator::addFalseCellsTo(ObstacleMapErrors* errors) const {
  uint64_t maps = 0;
  for (const auto& entry : false_cells_) {
    FalseCell cell = entry.second;
    cell.is_on_open = seen_ground_.countAround(cell.world_m) > 0;
    errors->false_cells.push_back(cell);
    if (!cell.is_on_open) {
      ++errors->num_false_hidden;
      continue;
    }
    ++errors->num_false_cells;
    errors->num_false_left += cell.is_left ? 1 : 0;
    maps += cell.frames;
  }
  errors->false_cells_per_10_m =
      driven_m_ > 0.0 ? 10.0 * static_cast<double>(errors->num_false_cells) / driven_m_ : 0.0;
  errors->false_cells_per_map =
      num_frames_ > 0 ? static_cast<double>(maps) / static_cast<double>(num_frames_) : 0.0;
}

void ObstacleMapEvaluator::judgeMovers(const Frame& frame) {
  for (const TruthObstacle& mover : frame.movers) {
    if (frame.seenPointsOf(mover) >= options_.min_seen_points) {
      ++num_mover_frames_;
      num_mover_reported_ += frame.reports(mover, options_.tolerance_m) ? 1 : 0;
      for (int row = 0; row < frame.map.state.rows; ++row) {
        for (int column = 0; column < frame.map.state.cols; ++column) {
          if (distanceToPolygon(frame.worldOf(column, row), mover.footprint_m) > 0.0) {
            continue;
          }
          ++num_mover_cells_;
          num_mover_free_ += frame.map.state.at<int8_t>(row, column) == kCellFree ? 1 : 0;
        }
      }
    }
  }
}

ObstacleMapErrors ObstacleMapEvaluator::errors() const {
  ObstacleMapErrors errors;
  errors.num_frames = num_frames_;
  errors.driven_m = driven_m_;
  for (const Tracked& tracked : tracked_) {
    if (tracked.judged) {
      errors.obstacles.push_back(tracked.outcome);
    }
  }
  addFalseCellsTo(&errors);
  errors.num_observed_inside = observed_inside_.size();
  errors.num_free_inside = free_inside_.size();
  std::vector<double> height_errors_m;
  for (const KerbPoint& point : kerb_points_) {
    if (!point.judged) {
      continue;
    }
    ++errors.num_kerb_points;
    errors.kerbs.push_back(point.outcome);
    if (point.outcome.reported) {
      ++errors.num_kerb_reported;
      height_errors_m.push_back(point.outcome.height_error_m);
    }
  }
  errors.kerb_height_error_m = summarize(height_errors_m);
  errors.num_mover_frames = num_mover_frames_;
  errors.num_mover_reported = num_mover_reported_;
  errors.num_mover_cells = num_mover_cells_;
  errors.num_mover_free = num_mover_free_;
  return errors;
}

}  // namespace vcharge
