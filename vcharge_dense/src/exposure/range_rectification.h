#pragma once

#include "vcharge_core/camera/ray_table.h"
#include "vcharge_core/dense_maps/range_map.h"
#include "vcharge_dense/exposure.h"

namespace vcharge {

/// The range map of a camera that exposes all pixels at the image's stamp, from one whose pixels are seen
/// from where the camera was when it exposed them. Each pixel is looked up where the camera saw what it
/// shows; of surfaces that hide each other, either may be found within a pixel or two of the edge. `rays`:
/// those of the map's camera. The reference image is moved alike.
RangeMap rectified(const RangeMap& map, const RayTable& rays, const Exposure& exposure);

}  // namespace vcharge
