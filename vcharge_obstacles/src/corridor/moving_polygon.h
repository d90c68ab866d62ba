#pragma once

#include <optional>
#include <vector>

#include <Eigen/Core>

namespace vcharge {

/// Time until a convex polygon that moves at a constant velocity touches a convex polygon that stands; 0 if
/// they touch already, nothing if they never do. Exact (separating axes). Polygons may be a point or a
/// segment; their orientation does not matter.
std::optional<double> timeToTouch_s(const std::vector<Eigen::Vector2d>& moving_m,
                                    const Eigen::Vector2d& velocity_m_per_s,
                                    const std::vector<Eigen::Vector2d>& standing_m);

}  // namespace vcharge
