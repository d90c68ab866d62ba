#include "vcharge_evaluation/obstacle_map_errors.h"

#include <algorithm>
#include <cmath>
#include <limits>

#include <opencv2/imgproc.hpp>

#include "obstacles/judged_map.h"
#include "vcharge_evaluation/travel_angle.h"

namespace vcharge {
namespace {

using internal::kMaxHeight_m;
using internal::kMinSeenPoints;
using internal::kOpenHeight_m;
using internal::kOpenRadius_m;
using internal::kSeenHeight_m;
using internal::kTolerance_m;
using internal::OccupiedCell;

// Distances of the vehicle's front axle and middle from its rear axle, and half its width.
constexpr double kWheelbase_m = 2.6;
constexpr double kMiddle_m = 1.4;
constexpr double kHalfWidth_m = 0.9;
// An obstacle is at least this wide, and must be reported after this travel.
constexpr double kMinWidth_m = 0.1;
constexpr double kGrace_m = 1.0;
// Cells further from the vehicle's middle are not judged as false.
constexpr double kFalseRange_m = 5.0;
// A cell lies inside an obstacle if everything around it has this height.
constexpr float kInsideHeight_m = 0.2F;
// Points on the outlines of kerbs between these heights are judged.
constexpr double kKerbMin_m = 0.1;
constexpr double kKerbMax_m = 0.16;
constexpr double kSeenKerbHeight_m = 0.04;  // height of a visible point of a kerb
constexpr double kKerbStep_m = 0.1;
constexpr double kKerbTolerance_m = 0.15;
constexpr double kKerbWidth_m = 0.2;

/// Distance of points from the ground between the wheels, over all poses.
double distanceFromPath(const std::vector<Eigen::Vector2d>& points_m,
                        const std::vector<RigidTransform>& path) {
  double nearest = std::numeric_limits<double>::infinity();
  for (const RigidTransform& pose : path) {
    for (const double x : {0.0, kWheelbase_m}) {
      const Eigen::Vector2d axle = (pose * Eigen::Vector3d(x, 0.0, 0.0)).head<2>();
      for (const Eigen::Vector2d& point : points_m) {
        nearest = std::min(nearest, (point - axle).norm());
      }
    }
  }
  return std::max(0.0, nearest - kHalfWidth_m);
}

cv::Mat withoutNaN(const cv::Mat& image) {
  cv::Mat known = image.clone();
  cv::patchNaNs(known, 0.0);
  return known;
}

/// False if the obstacle is certainly further away.
bool isNear(const TruthObstacle& obstacle, const Eigen::Vector2d& position_m, double distance_m) {
  return (obstacle.middle_m() - position_m).norm() <= distance_m + obstacle.width_m();
}

bool isNearAny(const std::vector<TruthObstacle>& obstacles, const Eigen::Vector2d& position_m,
               double distance_m) {
  return std::any_of(obstacles.begin(), obstacles.end(), [&](const TruthObstacle& obstacle) {
    return distanceToPolygon(position_m, obstacle.footprint_m) <= distance_m;
  });
}

}  // namespace

struct ObstacleMapEvaluator::Frame : internal::JudgedMap {
  using JudgedMap::JudgedMap;

  Eigen::Vector2d vehicle_middle_m;
  SeenCells seen_high, seen_low;  // visible surfaces off the direction of travel, within the view range
  std::vector<TruthObstacle> movers, earlier_movers;
};

ObstacleMapEvaluator::ObstacleMapEvaluator(const std::vector<TruthObstacle>& obstacles,
                                           const TruthHeights& heights,
                                           const std::vector<RigidTransform>& path,
                                           const ObstacleMapEvaluationOptions& options)
    : options_(options), heights_(heights) {
  options_.validate();
  const cv::Mat known = withoutNaN(heights.height_m);
  highest_around_ = internal::highestWithin(heights, kOpenRadius_m);
  const cv::Mat highest_on_kerbs = internal::highestWithin(heights, kKerbWidth_m);
  cv::erode(known, lowest_around_, cv::getStructuringElement(cv::MORPH_RECT, {3, 3}));
  for (const TruthObstacle& obstacle : obstacles) {
    if (obstacle.top_z_m >= kOpenHeight_m && obstacle.base_z_m < kMaxHeight_m) {
      standing_.push_back(obstacle);
    }
    std::vector<Eigen::Vector2d> outline = obstacle.footprint_m;
    if (obstacle.kind == "kerb") {
      addKerbPoints(obstacle, highest_on_kerbs, path);
    }
    for (size_t i = 0; i < obstacle.footprint_m.size(); ++i) {  // a long wall may be near without its corners
      const Eigen::Vector2d& a = obstacle.footprint_m[i];
      const Eigen::Vector2d& b = obstacle.footprint_m[(i + 1) % obstacle.footprint_m.size()];
      for (double fraction = 0.1; fraction < 0.95; fraction += 0.1) {
        outline.push_back(a + fraction * (b - a));
      }
    }
    const double distance_m = distanceFromPath(outline, path);
    if (obstacle.height_m() >= options_.min_height_m && obstacle.width_m() >= kMinWidth_m &&
        obstacle.base_z_m < kMaxHeight_m && distance_m <= options_.corridor_m) {
      tracked_.push_back(
          {obstacle,
           std::nullopt,
           false,
           {obstacle.kind, obstacle.middle_m(), obstacle.height_m(), obstacle.width_m(), distance_m}});
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
      // Grass and bushes on the island may hide the height of the kerb itself.
      const double height_m = heights_.at(highest_m, point);
      if (height_m >= kKerbMin_m && height_m <= kKerbMax_m &&
          distanceFromPath({point}, path) <= options_.corridor_m) {
        KerbOutcome outcome;
        outcome.position_m = point;
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
  sums_.driven_m += last_position_m_ ? (position - *last_position_m_).norm() : 0.0;
  last_position_m_ = position;
  ++sums_.num_frames;
  Frame frame(map, world_from_vehicle);
  frame.vehicle_middle_m = (frame.level * Eigen::Vector3d(kMiddle_m, 0.0, 0.0)).head<2>();
  frame.movers = movers;
  frame.earlier_movers = earlier_movers;
  for (const SeenPoint& point : points) {
    const Eigen::Vector2d point_m = point.world_m.head<2>().cast<double>();
    const double height_m = point.world_m.z();
    const double distance_m = (point_m - frame.vehicle_middle_m).norm();
    if (height_m < kOpenHeight_m && distance_m <= kFalseRange_m) {
      seen_ground_.add(point_m);
    }
    if (point.from_travel_rad < kMinAngleFromTravel_rad || distance_m > options_.view_range_m) {
      continue;
    }
    if (height_m >= kSeenHeight_m && height_m <= kMaxHeight_m) {
      frame.seen_high.add(point_m);
    }
    if (height_m >= kSeenKerbHeight_m && height_m <= kKerbMax_m) {
      frame.seen_low.add(point_m);
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
        internal::seenPointsOf(frame.seen_high, tracked.obstacle) < kMinSeenPoints) {
      continue;
    }
    if (!tracked.first_view_m) {
      tracked.first_view_m = sums_.driven_m;
    }
    if (sums_.driven_m < *tracked.first_view_m + kGrace_m) {
      continue;
    }
    const bool reported = frame.reports(tracked.obstacle);
    if (!tracked.judged) {
      tracked.judged = true;
      tracked.outcome.reported = reported;
    }
    ++tracked.outcome.frames;
    tracked.outcome.frames_reported += reported ? 1 : 0;
  }
}

/// Height error of the nearest occupied cell that reports a kerb point; absent without one.
std::optional<double> ObstacleMapEvaluator::kerbHeightError(const Frame& frame, const KerbPoint& point) {
  std::optional<double> error_m;
  double nearest_m = kKerbTolerance_m;
  for (const OccupiedCell& cell : frame.occupied) {
    const double distance_m = (cell.world_m - point.outcome.position_m).norm();
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
    const double distance_m = (outcome.position_m - frame.vehicle_middle_m).norm();
    if (!point.first_view_m && frame.seen_low.countAround(outcome.position_m) >= kMinSeenPoints) {
      point.first_view_m = sums_.driven_m;
    }
    if (!point.first_view_m) {
      continue;
    }
    outcome.nearest_m = std::min(outcome.nearest_m, distance_m);
    const bool is_due = !point.judged && sums_.driven_m >= *point.first_view_m + kGrace_m;
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
  std::vector<TruthObstacle> nearby;
  std::copy_if(standing_.begin(), standing_.end(), std::back_inserter(nearby),
               [&](const TruthObstacle& obstacle) {
                 return isNear(obstacle, frame.vehicle_middle_m, kFalseRange_m + 1.0);
               });
  frame.forEachCell([&](int column, int row, int8_t state) {
    const int64_t fixed_key = SeenCells::keyOf(frame.fixedOf(column, row));
    const auto known = false_cells_.find(fixed_key);
    if (known != false_cells_.end() && state != kCellOccupied) {
      known->second.is_left = false;
    }
    const Eigen::Vector2d position = frame.worldOf(column, row);
    if (state == kCellUnobserved || (position - frame.vehicle_middle_m).norm() > kFalseRange_m) {
      return;
    }
    const int64_t key = SeenCells::keyOf(position);
    if (heights_.at(lowest_around_, position) >= kInsideHeight_m) {
      observed_inside_.insert(key);
      if (state == kCellFree) {
        free_inside_.insert(key);
      }
    } else if (state == kCellOccupied && !isNearAny(frame.earlier_movers, position, kTolerance_m) &&
               !isNearAny(nearby, position, kOpenRadius_m) &&  // the height map may miss thin posts

               heights_.at(highest_around_, position) < static_cast<float>(kOpenHeight_m)) {
      FalseCell& cell =
          false_cells_.try_emplace(fixed_key, FalseCell{position, frame.map.stamp}).first->second;
      ++cell.frames;
      cell.is_left = true;
    }
  });
}

void ObstacleMapEvaluator::addFalseCellsTo(ObstacleMapErrors* errors) const {
  size_t maps = 0;
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
  if (errors->driven_m > 0.0) {
    errors->false_cells_per_10_m = 10.0 * static_cast<double>(errors->num_false_cells) / errors->driven_m;
  }
  if (errors->num_frames > 0) {
    errors->false_cells_per_map = static_cast<double>(maps) / static_cast<double>(errors->num_frames);
  }
}

void ObstacleMapEvaluator::judgeMovers(const Frame& frame) {
  for (const TruthObstacle& mover : frame.movers) {
    if (internal::seenPointsOf(frame.seen_high, mover) < kMinSeenPoints) {
      continue;
    }
    MoverCounts& counts = sums_.movers[mover.kind];
    ++counts.frames;
    counts.frames_reported += frame.reports(mover) ? 1 : 0;
    frame.forEachCell([&](int column, int row, int8_t state) {
      if (distanceToPolygon(frame.worldOf(column, row), mover.footprint_m) <= 0.0) {
        ++sums_.num_mover_cells;
        sums_.num_mover_free += state == kCellFree ? 1 : 0;
      }
    });
  }
}

ObstacleMapErrors ObstacleMapEvaluator::errors() const {
  ObstacleMapErrors errors = sums_;
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
  return errors;
}

}  // namespace vcharge
