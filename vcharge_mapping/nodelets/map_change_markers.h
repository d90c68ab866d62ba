#pragma once

#include <visualization_msgs/MarkerArray.h>

#include "vcharge_mapping/map_difference.h"

namespace vcharge {

/// Three lists of points in the frame `map`, in the namespaces "appeared" (green), "vanished" (red) and
/// "moved" (yellow). A list without points has the action DELETE, to remove those of another version.
visualization_msgs::MarkerArray makeChangeMarkers(const MapDifference& difference);

}  // namespace vcharge
