#include "vcharge_evaluation/step_errors.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <unordered_set>

#include <opencv2/imgproc.hpp>

namespace vcharge {
namespace {

// Distance between the two heights that make a step, and from the edge to the points of both sides that must
// have been visible.
constexpr double kRun_m = 0.1;
constexpr double kBeside_m = 0.15;
// Around tall things and moving ones, heights are not those of the ground.
constexpr double kTallRadius_m = 0.4;
constexpr double kMoverRadius_m = 0.5;
// Rises of this fraction of the lowest step may be reported: the truth is sampled in cells.
constexpr double kMayBeReported = 0.8;
constexpr double kRounding_m = 0.001;

cv::Mat disk(double radius_m, double cell_size_m) {
  const int side = 2 * static_cast<int>(std::ceil(radius_m / cell_size_m - 1e-6)) + 1;
  return cv::getStructuringElement(cv::MORPH_ELLIPSE, {side, side});
}

RigidTransform levelled(const RigidTransform& transform) {
  return RigidTransform::planar(transform.translation().x(), transform.translation().y(),
                                yawOfRotation(transform.rotation()));
}

Eigen::Vector2d transformed(const RigidTransform& transform, const Eigen::Vector2d& point_m) {
  return (transform * Eigen::Vector3d(point_m.x(), point_m.y(), 0.0)).head<2>();
}

/// Height of the highest step reported within a radius; 0 without one.
float reportedNear(const StepMap& map, const Eigen::Vector2d& fixed_m, double radius_m) {
  const Eigen::Vector2d cell = (fixed_m - map.origin_m) / map.cell_size_m;
  const int reach = static_cast<int>(std::ceil(radius_m / map.cell_size_m));
  float highest_m = 0.0F;
  for (int row = static_cast<int>(std::floor(cell.y())) - reach; row <= cell.y() + reach; ++row) {
    for (int column = static_cast<int>(std::floor(cell.x())) - reach; column <= cell.x() + reach; ++column) {
      const bool is_inside = row >= 0 && column >= 0 && row < map.height_m.rows && column < map.height_m.cols;
      const double distance_m = map.cell_size_m * (Eigen::Vector2d(column + 0.5, row + 0.5) - cell).norm();
      if (is_inside && distance_m <= radius_m && map.height_m.at<float>(row, column) > highest_m) {
        highest_m = map.height_m.at<float>(row, column);
      }
    }
  }
  return highest_m;
}

}  // namespace

StepTruth::StepTruth(const TruthHeights& heights) : heights_(heights) {
  const double cell_m = heights.cell_size_m;
  const cv::Mat is_known = heights.height_m == heights.height_m;  // false for NaN
  cv::Mat known = heights.height_m.clone();
  cv::patchNaNs(known, 0.0);
  cv::Mat lowest, highest, tall;
  cv::erode(known, lowest, disk(kTallRadius_m, cell_m));
  cv::Mat is_tall = (known - lowest) > kTall_m;
  cv::dilate(is_tall | ~is_known, tall, disk(kTallRadius_m, cell_m));
  // Steeper than a ramp over the run, and about as high as a step: a map may report that.
  cv::erode(known, lowest, disk(0.5 * kRun_m, cell_m));
  cv::dilate(known, highest, disk(0.5 * kRun_m, cell_m));
  const cv::Mat may_be_step = (highest - lowest) >= kMayBeReported * kMinStep_m;
  cv::Mat near_step;
  cv::dilate(may_be_step, near_step, disk(kTolerance_m, cell_m));
  even_ = cv::Mat::ones(known.size(), CV_32FC1);
  even_.setTo(0.0, near_step | tall);
  findAlong({1, 0}, tall);
  findAlong({0, 1}, tall);
}

/// Adds the steps along one axis: where heights a run apart differ, the middle of all such pairs.
void StepTruth::findAlong(const Eigen::Vector2i& axis, const cv::Mat& tall) {
  const double cell_m = heights_.cell_size_m;
  const int run = std::max(1, static_cast<int>(std::lround(kRun_m / cell_m)));
  const double least_m = std::max(kMinStep_m, kMaxSlope * run * cell_m) - kRounding_m;
  const cv::Mat& height_m = heights_.height_m;
  const int lines = axis.x() == 1 ? height_m.rows : height_m.cols;
  const int length = axis.x() == 1 ? height_m.cols : height_m.rows;
  const auto cellOf = [&](int line, int along) {
    return axis.x() == 1 ? cv::Point(along, line) : cv::Point(line, along);
  };
  for (int line = 0; line < lines; ++line) {
    int begin = 0;
    double highest_m = 0.0;  // of the pairs since `begin`, with sign
    for (int along = 0; along + run <= length; ++along) {
      const double rise_m = along + run < length
                                ? static_cast<double>(height_m.at<float>(cellOf(line, along + run))) -
                                      static_cast<double>(height_m.at<float>(cellOf(line, along)))
                                : 0.0;
      const bool is_step = std::abs(rise_m) >= least_m && std::abs(rise_m) <= kTall_m;
      if (highest_m != 0.0 && (!is_step || rise_m * highest_m < 0.0)) {
        const double middle = 0.5 * (begin + along - 1 + run);
        const Eigen::Vector2d across = Eigen::Vector2d(axis.y(), axis.x()) * line;
        const Eigen::Vector2d direction = axis.cast<double>();
        if (tall.at<uint8_t>(cellOf(line, static_cast<int>(middle))) == 0) {
          steps_.push_back({heights_.origin_m + cell_m * (across + direction * middle),
                            highest_m > 0.0 ? direction : Eigen::Vector2d(-direction), std::abs(highest_m)});
        }
        highest_m = 0.0;
      }
      if (is_step) {
        begin = highest_m == 0.0 ? along : begin;
        highest_m = std::abs(rise_m) > std::abs(highest_m) ? rise_m : highest_m;
      }
    }
  }
}

bool StepTruth::isEven(const Eigen::Vector2d& world_m) const {
  return heights_.at(even_, world_m) > 0.5F;
}

double StepClassErrors::foundFraction() const {
  return num_due > 0 ? static_cast<double>(num_found) / static_cast<double>(num_due)
                     : std::numeric_limits<double>::quiet_NaN();
}

StepEvaluator::StepEvaluator(const TruthHeights& heights)
    : truth_(heights), progress_(truth_.steps().size()) {}

void StepEvaluator::noteSeen(const std::vector<SeenPoint>& seen) {
  SeenCells cells;
  for (const SeenPoint& point : seen) {
    cells.add(point.world_m.head<2>().cast<double>());
  }
  for (size_t i = 0; i < progress_.size(); ++i) {
    Progress& progress = progress_[i];
    if (progress.is_low_seen && progress.is_high_seen) {
      continue;
    }
    const TrueStep& step = truth_.steps()[i];
    const auto isSeen = [&](double beside_m) {
      return cells.counts().count(SeenCells::keyOf(step.world_m + beside_m * step.up)) > 0;
    };
    progress.is_low_seen = progress.is_low_seen || isSeen(-kBeside_m);
    progress.is_high_seen = progress.is_high_seen || isSeen(kBeside_m);
    progress.seen_from_m = travel_m_;
  }
}

void StepEvaluator::judgeSteps(const StepMap& map, const RigidTransform& world_from_vehicle,
                               const RigidTransform& world_from_fixed) {
  const Outline outline =
      vehicleOutline(levelled(world_from_vehicle), kVehicleFront_m, kVehicleRear_m, kVehicleHalfWidth_m);
  const RigidTransform fixed_from_world = world_from_fixed.inverse();
  for (size_t i = 0; i < progress_.size(); ++i) {
    Progress& progress = progress_[i];
    const TrueStep& step = truth_.steps()[i];
    if (!progress.is_low_seen || !progress.is_high_seen || travel_m_ < progress.seen_from_m + kViewTravel_m) {
      continue;
    }
    const double distance_m = distanceToPolygon(step.world_m, outline);
    if (distance_m <= 0.0 || distance_m > kDistance_m) {
      continue;
    }
    const float height_m =
        reportedNear(map, transformed(fixed_from_world, step.world_m), StepTruth::kTolerance_m);
    ++progress.num_due;
    progress.num_found += height_m > 0.0F ? 1 : 0;
    progress.sum_height_m += height_m;
  }
}

void StepEvaluator::judgeFalse(const StepMap& map, const RigidTransform& world_from_fixed,
                               const std::vector<TruthObstacle>& movers) {
  for (int row = 0; row < map.height_m.rows; ++row) {
    for (int column = 0; column < map.height_m.cols; ++column) {
      if (!(map.height_m.at<float>(row, column) > 0.0F)) {
        continue;
      }
      const Eigen::Vector2d world_m = transformed(
          world_from_fixed, map.origin_m + map.cell_size_m * Eigen::Vector2d(column + 0.5, row + 0.5));
      const bool is_mover = std::any_of(movers.begin(), movers.end(), [&](const TruthObstacle& mover) {
        return distanceToPolygon(world_m, mover.footprint_m) <= kMoverRadius_m;
      });
      if (truth_.isEven(world_m) && !is_mover) {
        false_cells_.insert(SeenCells::keyOf(world_m));
      }
    }
  }
}

void StepEvaluator::add(const StepMap& map, const std::vector<SeenPoint>& seen,
                        const RigidTransform& world_from_vehicle, const std::vector<TruthObstacle>& movers) {
  const Eigen::Vector2d position_m = world_from_vehicle.translation().head<2>();
  travel_m_ += num_maps_ > 0 ? (position_m - last_position_m_).norm() : 0.0;
  last_position_m_ = position_m;
  ++num_maps_;
  const RigidTransform world_from_fixed =
      levelled(world_from_vehicle) * levelled(map.fixed_from_vehicle).inverse();
  noteSeen(seen);
  judgeSteps(map, world_from_vehicle, world_from_fixed);
  judgeFalse(map, world_from_fixed, movers);
}

StepErrors StepEvaluator::errors() const {
  StepErrors errors;
  errors.num_maps = num_maps_;
  errors.driven_m = travel_m_;
  for (size_t i = 0; i < progress_.size(); ++i) {
    const Progress& progress = progress_[i];
    const TrueStep& step = truth_.steps()[i];
    if (progress.num_due == 0) {
      continue;
    }
    StepClassErrors& all = step.rise_m >= StepTruth::kHighStep_m ? errors.high : errors.low;
    all.length_m += truth_.cellSize_m();
    all.found_length_m += 2 * progress.num_found > progress.num_due ? truth_.cellSize_m() : 0.0;
    all.num_due += progress.num_due;
    all.num_found += progress.num_found;
    all.mean_height_error_m += progress.sum_height_m - step.rise_m * static_cast<double>(progress.num_found);
  }
  for (StepClassErrors* all : {&errors.low, &errors.high}) {
    all->mean_height_error_m /= static_cast<double>(std::max<uint64_t>(1, all->num_found));
  }
  std::set<int64_t> waiting = false_cells_;
  errors.num_false_cells = waiting.size();
  while (!waiting.empty()) {
    ++errors.num_false_steps;
    std::vector<int64_t> group = {*waiting.begin()};
    waiting.erase(waiting.begin());
    while (!group.empty()) {
      const Eigen::Vector2d middle_m = SeenCells::middleOf(group.back());
      group.pop_back();
      errors.false_cells_m.push_back(middle_m);
      for (int k = 0; k < 9; ++k) {
        const auto found = waiting.find(
            SeenCells::keyOf(middle_m + SeenCells::kCell_m * Eigen::Vector2d(k % 3 - 1, k / 3 - 1)));
        if (found != waiting.end()) {
          group.push_back(*found);
          waiting.erase(found);
        }
      }
    }
  }
  return errors;
}

}  // namespace vcharge
