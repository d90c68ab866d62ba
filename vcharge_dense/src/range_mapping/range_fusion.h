#pragma once

#include "vcharge_core/dense_maps/range_map.h"
#include "vcharge_core/motion/rigid_transform.h"

namespace vcharge {

/// A copy with pixels of its own; cv::Mat would refer to those of `map`.
RangeMap copyOf(const RangeMap& map);

/// The ranges of `map` that the range map of another camera at the same instant confirms: the inverse range
/// of the point, seen from the other camera, differs from the one measured there by at most `tolerance_per_m`
/// (1/m). The others become unknown.
RangeMap confirmedRanges(const RangeMap& map, const RangeMap& other, const RigidTransform& other_from_camera,
                         double tolerance_per_m);

/// Fuses two range maps of one camera and stamp. Where both have a range, the inverse ranges are averaged
/// with the inverses of their variances as weights, and the confidences combine as those of independent
/// measurements. Where they contradict each other, as on what moved between the images of one of them, the
/// range is unknown. Throws std::logic_error for maps of different stamps or sizes.
RangeMap fuseRangeMaps(const RangeMap& a, const RangeMap& b);

}  // namespace vcharge
