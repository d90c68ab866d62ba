#include "dense/height_steps.h"

#include <algorithm>
#include <cmath>
#include <iterator>
#include <random>

#include "obstacles/map_cells.h"

namespace vcharge {
namespace {

constexpr double kSample_m = 0.01;      // distance between samples along a line
constexpr double kFlat_m = 0.03;        // largest difference of heights on a plateau
constexpr double kReadHeight_m = 0.15;  // height above the ground at which a high step is located
constexpr double kBeside_m = 0.1;       // distance from a line to those beside it
constexpr double kMaxSkew_m = 0.058;    // offset of the edge on those lines: 30 degrees
constexpr double kSpacing_m = 0.1;      // distance between the lines that are searched
constexpr double kMinLength_m = 0.5;    // shortest tape-measure distance
constexpr double kMaxLength_m = 6.0;
constexpr double kFarApart_m = 12.8;   // between measurements of one kind at first; halved repeatedly
constexpr double kApart_m = 0.4;       // smallest such distance, if there is too little room
constexpr double kOverEdge_m = 0.05;   // distance from an edge onto the object that it belongs to
constexpr double kOnOneLine_m = 0.02;  // offset of two steps on one line

bool isFlat(const HeightMap& map, const Eigen::Vector2d& position_m, const Eigen::Vector2d& direction,
            double length_m) {
  const double first = nearestHeight(map, position_m);
  for (double s = 0.0; s <= length_m; s += map.cell_size_m) {
    if (!(std::abs(nearestHeight(map, position_m + s * direction) - first) <= kFlat_m)) {
      return false;
    }
  }
  return true;
}

/// The step between two neighbouring cells; absent if its height or edge is not well defined.
std::optional<HeightStep> stepBetween(const HeightMap& truth, const Eigen::Vector2d& low_cell_m,
                                      const Eigen::Vector2d& direction,
                                      const HeightMapErrorOptions& options) {
  HeightStep step;
  step.direction = direction;
  step.position_m = low_cell_m + 0.5 * truth.cell_size_m * direction;
  step.low_m = nearestHeight(truth, low_cell_m);
  const Eigen::Vector2d high_cell_m = low_cell_m + truth.cell_size_m * direction;
  step.high_m = nearestHeight(truth, high_cell_m);
  if (!(step.high_m - step.low_m > options.step_m) || !isFlat(truth, low_cell_m, -direction, kPlateau_m)) {
    return std::nullopt;
  }
  if (!isHigh(step) && !isFlat(truth, high_cell_m, direction, kPlateau_m)) {
    return std::nullopt;
  }
  const HeightAt height = [&](const Eigen::Vector2d& position_m) { return nearestHeight(truth, position_m); };
  const Eigen::Vector2d across(-direction.y(), direction.x());
  for (const double aside : {-kBeside_m, kBeside_m}) {
    const auto crossing = findCrossing(height, step.position_m + aside * across, direction, -0.2, 0.2,
                                       step.low_m + stepLevel(step));
    if (!crossing || std::abs(*crossing) > kMaxSkew_m) {
      return std::nullopt;
    }
  }
  return step;
}

void addLength(const HeightStep& a, const HeightStep& b, std::vector<TapeMeasurement>* lengths) {
  // The edge of a low object is visible over its top from behind.
  const auto isSeen = [](const HeightStep& step) { return step.foot_seen || step.both_sides_seen; };
  if (!isSeen(a) || !isSeen(b)) {
    return;
  }
  const bool along_x = std::abs(a.direction.x()) > 0.5;
  const bool same_axis = along_x == (std::abs(b.direction.x()) > 0.5);
  const Eigen::Vector2d between = b.position_m - a.position_m;
  const double aside = std::abs(along_x ? between.y() : between.x());
  const double length = between.norm();
  if (same_axis && aside < kOnOneLine_m && length >= kMinLength_m && length <= kMaxLength_m) {
    lengths->push_back({TapeMeasurement::Kind::kLength, a.position_m, b.position_m, length, std::nan("")});
  }
}

/// Whether both sides of a step are level, so that its height can be measured.
bool isLevel(const HeightMap& truth, const HeightStep& step) {
  return isFlat(truth, step.position_m - 0.5 * truth.cell_size_m * step.direction, -step.direction,
                kPlateau_m) &&
         isFlat(truth, step.position_m + 0.5 * truth.cell_size_m * step.direction, step.direction,
                kPlateau_m);
}

/// Selects up to `count` candidates in the given order, as far apart as possible.
std::vector<TapeMeasurement> spread(const std::vector<TapeMeasurement>& candidates, size_t count) {
  std::vector<TapeMeasurement> chosen;
  for (double apart_m = kFarApart_m; apart_m >= kApart_m; apart_m *= 0.5) {
    for (const TapeMeasurement& candidate : candidates) {
      const bool apart = std::none_of(chosen.begin(), chosen.end(), [&](const TapeMeasurement& other) {
        return (candidate.from_m + candidate.to_m - other.from_m - other.to_m).norm() < 2.0 * apart_m;
      });
      if (apart && chosen.size() < count) {
        chosen.push_back(candidate);
      }
    }
  }
  return chosen;
}

}  // namespace

std::optional<double> findCrossing(const HeightAt& height, const Eigen::Vector2d& start_m,
                                   const Eigen::Vector2d& direction, double from_m, double to_m,
                                   double level_m) {
  std::optional<double> nearest;
  double before = std::nan("");
  for (double s = from_m; s <= to_m; s += kSample_m) {
    const double here = height(start_m + s * direction);
    if (before < level_m && here >= level_m) {
      const double at = s - kSample_m * (here - level_m) / (here - before);
      if (!nearest || std::abs(at) < std::abs(*nearest)) {
        nearest = at;
      }
    }
    before = here;
  }
  return nearest;
}

bool isHigh(const HeightStep& step) {
  return step.high_m - step.low_m > 2.0 * kReadHeight_m;
}

bool isOnRigid(const HeightStep& step, const IsRigid& is_rigid) {
  return is_rigid(step.position_m + kOverEdge_m * step.direction, step.high_m);
}

double stepLevel(const HeightStep& step) {
  return isHigh(step) ? kReadHeight_m : 0.5 * (step.high_m - step.low_m);
}

std::vector<HeightStep> findHeightSteps(const HeightMap& truth, const HeightMapErrorOptions& options,
                                        const std::function<bool(const Eigen::Vector2d&)>& isSeen) {
  std::vector<HeightStep> steps;
  const int stride = std::max(1, static_cast<int>(std::lround(kSpacing_m / truth.cell_size_m)));
  const auto consider = [&](int column, int row, const Eigen::Vector2d& axis) {
    const Eigen::Vector2d position = truth.centreOf(column, row);
    for (const double side : {1.0, -1.0}) {
      auto step =
          stepBetween(truth, side > 0.0 ? position : Eigen::Vector2d(position + truth.cell_size_m * axis),
                      side * axis, options);
      if (step && isSeen(step->position_m - kPlateau_m * step->direction)) {
        step->both_sides_seen = isSeen(step->position_m + kPlateau_m * step->direction);
        steps.push_back(*step);
      }
    }
  };
  for (int row = 0; row < truth.height_m.rows; row += stride) {
    for (int column = 0; column + 1 < truth.height_m.cols; ++column) {
      consider(column, row, Eigen::Vector2d::UnitX());
    }
  }
  for (int column = 0; column < truth.height_m.cols; column += stride) {
    for (int row = 0; row + 1 < truth.height_m.rows; ++row) {
      consider(column, row, Eigen::Vector2d::UnitY());
    }
  }
  return steps;
}

std::vector<TapeMeasurement> pickMeasurements(const HeightMap& truth,
                                              const std::vector<HeightStep>& all_steps,
                                              const IsRigid& is_rigid, const HeightMapErrorOptions& options) {
  std::vector<HeightStep> steps;
  std::copy_if(all_steps.begin(), all_steps.end(), std::back_inserter(steps),
               [&](const HeightStep& step) { return isOnRigid(step, is_rigid); });
  std::vector<TapeMeasurement> heights, lengths;
  for (size_t i = 0; i < steps.size(); ++i) {
    if (steps[i].both_sides_seen && isLevel(truth, steps[i])) {
      const Eigen::Vector2d beside = kPlateau_m * steps[i].direction;
      const Eigen::Vector2d below = steps[i].position_m - beside, above = steps[i].position_m + beside;
      heights.push_back({TapeMeasurement::Kind::kHeight, below, above,
                         nearestHeight(truth, above) - nearestHeight(truth, below), std::nan("")});
    }
    for (size_t k = i + 1; k < steps.size(); ++k) {
      addLength(steps[i], steps[k], &lengths);
    }
  }
  std::mt19937 random(static_cast<uint32_t>(options.seed));
  std::shuffle(heights.begin(), heights.end(), random);
  std::shuffle(lengths.begin(), lengths.end(), random);
  const auto count = static_cast<size_t>(options.num_measurements);
  const size_t num_heights = spread(heights, count / 2).size();
  std::vector<TapeMeasurement> taken = spread(lengths, count - num_heights);
  const std::vector<TapeMeasurement> others = spread(heights, count - taken.size());
  taken.insert(taken.end(), others.begin(), others.end());
  return taken;
}

}  // namespace vcharge
