#pragma once

#include <string>
#include <vector>

#include <vcharge_msgs/TrackedObjects.h>

#include "vcharge_core/base/timestamp.h"
#include "vcharge_core/motion/tracked_object.h"

namespace vcharge {

/// Converts objects given in the frame `frame_id`; footprints are rounded to float.
vcharge_msgs::TrackedObjects toMessage(const std::vector<TrackedObject>& objects, Timestamp stamp,
                                       const std::string& frame_id);

/// Inverse of toMessage(). InputError that begins with `source` for a number that is not finite, or an
/// unknown class.
std::vector<TrackedObject> fromMessage(const vcharge_msgs::TrackedObjects& message,
                                       const std::string& source);

}  // namespace vcharge
