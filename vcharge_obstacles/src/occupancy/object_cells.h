#pragma once

#include <vector>

#include "vcharge_core/dense_maps/obstacle_map.h"
#include "vcharge_core/motion/tracked_object.h"

namespace vcharge {

/// Free cells under the footprints of objects, and within 0.2 m of them, become unobserved: what is known of
/// the ground there is older than the object. Objects are in the map's fixed frame.
void forgetFreeUnder(const std::vector<TrackedObject>& objects, ObstacleMap* map);

}  // namespace vcharge
