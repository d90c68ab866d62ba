#pragma once

#include <string>

#include <vcharge_msgs/Corridor.h>
#include <visualization_msgs/MarkerArray.h>

#include "vcharge_core/base/timestamp.h"
#include "vcharge_obstacles/corridor.h"

namespace vcharge {

/// `vehicle_frame`: the rig's.
vcharge_msgs::Corridor toMessage(const Corridor& corridor, Timestamp stamp, const std::string& vehicle_frame);

/// The arcs as strips in the vehicle frame, up to kCorridorMarker_m: green where known free, red from an
/// occupied cell on, yellow elsewhere, as in the blind rim around the body. Replaces earlier markers.
visualization_msgs::MarkerArray toMarkers(const Corridor& corridor, Timestamp stamp,
                                          const std::string& vehicle_frame);

/// Travel up to which the strips are drawn.
inline constexpr double kCorridorMarker_m = 6.0;

}  // namespace vcharge
