#pragma once

#include <functional>
#include <optional>
#include <vector>

#include "vcharge_evaluation/height_map_errors.h"

namespace vcharge {

/// Height at a point of the world; NaN without one.
using HeightAt = std::function<double(const Eigen::Vector2d& point_m)>;

/// Distance from `start_m` along the unit `direction`, between `from_m` and `to_m`, at which the heights rise
/// above `level_m`; the one nearest to 0. Absent if they never do.
std::optional<double> findCrossing(const HeightAt& height, const Eigen::Vector2d& start_m,
                                   const Eigen::Vector2d& direction, double from_m, double to_m,
                                   double level_m);

/// Height above the lower side at which a step is located: half of a low step, and 0.15 m above the ground
/// for a high one, whose top may not be visible.
double stepLevel(const HeightStep& step);

/// Whether a step is higher than 0.3 m.
bool isHigh(const HeightStep& step);

/// Whether a step is the edge of a rigid object.
bool isOnRigid(const HeightStep& step, const IsRigid& is_rigid);

/// Length of the flat plateaus beside a step, at whose ends heights are read.
constexpr double kPlateau_m = 0.15;

/// Finds steps of a true height map: jumps within a cell along rows and columns, between flat plateaus, at
/// edges within 30 degrees of the perpendicular. `isSeen`: whether the surface at a point is visible; the
/// lower side must be.
std::vector<HeightStep> findHeightSteps(const HeightMap& truth, const HeightMapErrorOptions& options,
                                        const std::function<bool(const Eigen::Vector2d& point_m)>& isSeen);

/// Selects tape-measure distances in the true scene, independently of any map: half of them heights of steps
/// between flat plateaus, half lengths between two edges on a line; if there are too few of one kind, more of
/// the other. Edges are of rigid objects and were visible from the front or over their top. The selection is
/// spread over the scene and depends on the options' seed.
std::vector<TapeMeasurement> pickMeasurements(const HeightMap& truth, const std::vector<HeightStep>& steps,
                                              const IsRigid& is_rigid, const HeightMapErrorOptions& options);

}  // namespace vcharge
