#pragma once

#include <string>
#include <vector>

#include "vcharge_core/motion/tracked_object.h"

namespace vcharge {

/// Tracked objects of a drive on disk, in FOLDER, one line of names above the values:
///   objects.csv          one line per object and stamp: stamp, id, class, probabilities, position, yaw and
///                        velocity over the ground, height, covariance of (x, y, vx, vy) as its upper
///                        triangle, footprint as "x y;x y;...", all in odom
///   objects_frames.csv   one line per stamp: odom_from_vehicle as x, y and yaw, and the number of its
///   objects
/// Numbers have as many digits as reading them back needs. Motion is planar: the files hold no heights of the
/// ground. objects_frames.csv is written last: where it exists, the objects are complete.
///
/// std::logic_error for stamps that do not increase, an id twice at one stamp, a footprint of fewer than
/// three corners, or a number that is not finite.
void writeObjects(const std::vector<ObjectFrame>& frames, const std::string& folder);

/// Reads what writeObjects wrote. InputError naming file, line and column.
std::vector<ObjectFrame> readObjects(const std::string& folder);

}  // namespace vcharge
