#pragma once

#include <functional>
#include <optional>
#include <vector>

#include "vcharge_evaluation/height_map_errors.h"

namespace vcharge {

/// Height at a place of the world, NaN where there is none.
using HeightAt = std::function<double(const Eigen::Vector2d& place_m)>;

/// Where the heights first exceed `level_m` along the line through `start_m`, looked for from `from_m` to
/// `to_m` (along the unit `direction`), nearest to 0. Absent where they never cross it upwards.
std::optional<double> findCrossing(const HeightAt& height, const Eigen::Vector2d& start_m,
                                   const Eigen::Vector2d& direction, double from_m, double to_m,
                                   double level_m);

/// Height above the lower side at which a step's place is read: half a low step, and a hand above the ground
/// of a high one, whose top no camera may see.
double stepLevel(const HeightStep& step);

/// Whether the place of a step is read a hand above the ground, below half its height.
bool isHigh(const HeightStep& step);

/// Whether a step is the edge of something rigid: what lies a little over it is.
bool isOnRigid(const HeightStep& step, const IsRigid& is_rigid);

/// Steps of a true height map: jumps within a cell along rows and columns, between places that are flat over
/// plateau_m, at edges that run across the line within 30 degrees. `isSeen` tells whether the surface at a
/// place is seen: lower sides must be.
std::vector<HeightStep> findHeightSteps(const HeightMap& truth, const HeightMapErrorOptions& options,
                                        const std::function<bool(const Eigen::Vector2d& place_m)>& isSeen);

/// Tape-measure distances as somebody would take them in the scene itself, whatever a map shows of it:
/// between edges of rigid things that the cameras saw, from in front of the face or over its top, and over
/// such edges, spread over the place, picked by the options' seed. Half of them are heights of steps that are
/// flat over plateau_m on both sides, half lengths between two edges on a line; where there are too few of
/// one kind the other fills up.
std::vector<TapeMeasurement> pickMeasurements(const HeightMap& truth, const std::vector<HeightStep>& steps,
                                              const IsRigid& is_rigid, const HeightMapErrorOptions& options);

}  // namespace vcharge
