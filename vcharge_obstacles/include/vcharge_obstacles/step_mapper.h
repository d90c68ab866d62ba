#pragma once

#include <cstdint>
#include <vector>

#include <Eigen/Core>

#include "vcharge_core/base/options.h"
#include "vcharge_core/dense_maps/step_map.h"
#include "vcharge_core/motion/rigid_transform.h"
#include "vcharge_core/motion/vehicle_footprint.h"
#include "vcharge_obstacles/scrolling_grid.h"

namespace vcharge {

/// Options of StepMapper.
struct StepMapperOptions {
  VCHARGE_BEGIN_OPTIONS(StepMapperOptions);
  VCHARGE_OPTION(double, min_step_m, 0.05, between(0.02, 0.3), "Height of the lowest step that is reported.");
  VCHARGE_OPTION(double, max_slope, 0.25, between(0.05, 1.0),
                 "Rise per run of the steepest ramp that wheels climb; steeper changes of height are steps.");
  VCHARGE_END_OPTIONS();
};

/// A measured point near the vehicle.
struct HeightPoint {
  float x_m = 0.0F, y_m = 0.0F;  ///< in the vehicle frame
  float height_m = 0.0F;         ///< above the range map's ground plane
  float variance_m2 = 0.0F;      ///< of the height
};
using HeightPoints = std::vector<HeightPoint>;

/// Height of the ground around the vehicle, fused over time and cameras in a grid that scrolls with the
/// vehicle in a fixed frame, and the steps in it. Wheels climb a ramp, but no step: the height changes by at
/// least min_step_m within kMaxRun_m, and more steeply than max_slope.
///
/// The planes of two range maps differ by some millimetres and milliradians. Each range map is therefore
/// levelled on the ground that the map knows already. Deterministic; not thread safe.
class StepMapper {
 public:
  static constexpr double kCell_m = 0.05;
  /// Distance from the vehicle's outline up to which ground is measured.
  static constexpr double kReach_m = 3.5;
  /// Largest horizontal distance between the upper and the lower side of a step. It covers the strip in front
  /// of a hole's far side, or behind a kerb, that is hidden from a camera.
  static constexpr double kMaxRun_m = 0.25;
  /// Smallest number of neighbouring cells that make a step.
  static constexpr int kMinStepCells = 10;

  explicit StepMapper(const VehicleOutline& outline, const StepMapperOptions& options = StepMapperOptions());

  /// Sets the vehicle's pose (x, y and yaw are used) and scrolls.
  void moveTo(Timestamp stamp, const RigidTransform& fixed_from_vehicle);
  /// Adds the points of one range map; std::logic_error before the first moveTo().
  void add(const HeightPoints& points);
  /// Moves all cells into a corrected fixed frame.
  void reanchor(const RigidTransform& new_from_old_fixed);

  /// The map at the last moveTo(); frame_id is left empty.
  StepMap snapshot() const;

 private:
  struct Cell {
    float height_m = 0.0F;
    float weight = 0.0F;   // inverse variance of the height, if all observations are right; 0: never observed
    float scatter = 0.0F;  // mean squared difference of the observations from the height
    int observations = 0;
  };
  /// Points of one range map in one cell.
  struct Sum {
    int64_t x = 0, y = 0;
    float weight = 0.0F, weighted_height = 0.0F;
    int count = 0;
    float height_m() const { return weighted_height / weight; }
  };

  std::vector<Sum> collect(const HeightPoints& points) const;
  Eigen::Vector3d levelOn(const std::vector<Sum>& sums) const;

  VehicleOutline outline_;
  StepMapperOptions options_;
  ScrollingGrid<Cell> cells_;  // in the fixed frame
  bool has_pose_ = false;
  Timestamp stamp_;
  RigidTransform fixed_from_vehicle_;
};

}  // namespace vcharge
