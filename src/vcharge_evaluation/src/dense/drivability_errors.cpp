#include "dense/drivability_errors.h"

#include <algorithm>
#include <cmath>

#include <tbb/parallel_for.h>

namespace vcharge {
namespace {

constexpr double kMargin_m = 0.1;
constexpr double kOverGround_m = 0.3;  // higher surfaces are not ground

void judgeFaces(const cv::Mat& states, double cell_size_m, const MapInWorld& in_world,
                const std::vector<HeightStep>& steps, const IsRigid& is_rigid, DrivabilityErrors* errors) {
  for (const HeightStep& step : steps) {
    if (!isHigh(step) || !step.foot_seen || !isOnRigid(step, is_rigid)) {
      continue;
    }
    bool blocked = false, unobserved = false;
    for (double s = -kMargin_m; s <= kMargin_m; s += 0.5 * cell_size_m) {
      const cv::Point at = in_world.cellAt(step.position_m + s * step.direction, step.low_m);
      const auto state = cv::Rect(cv::Point(), states.size()).contains(at)
                             ? static_cast<CellState>(states.at<uint8_t>(at))
                             : CellState::kUnobserved;
      blocked = blocked || state == CellState::kObstacle;
      unobserved = unobserved || state == CellState::kUnobserved;
    }
    ++errors->num_faces;
    errors->num_faces_blocked += blocked ? 1 : 0;
    if (!blocked && !unobserved) {
      errors->open_faces.push_back(step);
    }
  }
}

/// Height of the ground at the vehicle's nearest pose to a point.
double groundNear(const Trajectory& world_from_vehicle, const Eigen::Vector2d& position_m) {
  const auto distance = [&](const StampedTransform& pose) {
    return (pose.world_from_vehicle.translation().head<2>() - position_m).squaredNorm();
  };
  return std::min_element(
             world_from_vehicle.begin(), world_from_vehicle.end(),
             [&](const StampedTransform& a, const StampedTransform& b) { return distance(a) < distance(b); })
      ->world_from_vehicle.translation()
      .z();
}

}  // namespace

DrivabilityErrors judgeDrivability(const HeightMap& map, const MapInWorld& in_world, const HeightMap& truth,
                                   const Trajectory& world_from_vehicle, const cv::Mat& seen,
                                   const std::vector<HeightStep>& steps, const IsRigid& is_rigid,
                                   double step_m) {
  const cv::Mat states = classifyCells(map, DrivabilityOptions());
  DrivabilityErrors errors;
  judgeFaces(states, map.cell_size_m, in_world, steps, is_rigid, &errors);
  std::vector<DrivabilityErrors> of_row(static_cast<size_t>(states.rows));
  tbb::parallel_for(0, states.rows, [&](int row) {
    DrivabilityErrors& sum = of_row[static_cast<size_t>(row)];
    for (int column = 0; column < states.cols; ++column) {
      const Eigen::Vector2d position = in_world.cell(column, row, 0.0).head<2>();
      const double height = interpolateHeight(truth, position);
      const bool is_drivable = states.at<uint8_t>(row, column) == static_cast<uint8_t>(CellState::kDrivable);
      const bool is_solid = !map.solid.empty() && map.solid.at<uint8_t>(row, column) != 0;
      const bool is_seen = seen.at<uint8_t>(row, column) != 0;
      sum.num_solid += is_solid ? 1 : 0;
      if (!std::isfinite(height) || !(is_drivable || is_solid || is_seen)) {
        continue;
      }
      const double limit_m = groundNear(world_from_vehicle, position) + kOverGround_m;
      const bool is_open = height < limit_m && spreadAround(truth, position, 2.0 * kMargin_m) <= step_m;
      sum.num_solid_on_ground += is_solid && is_open ? 1 : 0;
      sum.num_open_ground += is_seen && is_open ? 1 : 0;
      sum.num_open_drivable += is_seen && is_open && is_drivable ? 1 : 0;
      sum.num_drivable += is_drivable ? 1 : 0;
      sum.num_drivable_inside +=
          is_drivable && extentAround(truth, position, kMargin_m).low > limit_m ? 1 : 0;
    }
  });
  for (const DrivabilityErrors& row : of_row) {
    errors.num_solid += row.num_solid;
    errors.num_solid_on_ground += row.num_solid_on_ground;
    errors.num_open_ground += row.num_open_ground;
    errors.num_open_drivable += row.num_open_drivable;
    errors.num_drivable += row.num_drivable;
    errors.num_drivable_inside += row.num_drivable_inside;
  }
  return errors;
}

}  // namespace vcharge
