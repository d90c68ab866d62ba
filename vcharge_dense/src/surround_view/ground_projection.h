#pragma once

#include <cstdint>
#include <vector>

#include "surround_view/view_grid.h"
#include "vcharge_core/camera/camera_rig.h"

namespace vcharge {

/// How one camera shows a pixel of the view: the upper left of four pixels of its ImagePyramid, and the
/// weights of the right and the lower ones in 256ths.
struct PyramidPosition {
  int32_t offset = 0;
  uint8_t right = 0, down = 0;
};

/// Where a camera sees the pixels of a view, in row-major order.
struct GroundProjection {
  std::vector<PyramidPosition> positions;
  /// Standard deviation on the surface, in metres: of half a pixel of the camera, and of its extrinsics.
  /// Infinite where the camera does not see the surface.
  std::vector<float> sigma_m;
  /// Angle between the optical axis and the ray, in kAngleSteps per half turn.
  std::vector<uint8_t> angles;
};

/// Steps of an angle from the optical axis in half a turn.
inline constexpr int kAngleSteps = 255;

/// Projects a view into a camera with extrinsics. The camera sees nothing below the vehicle, outside its
/// field of view, its image and its mask.
GroundProjection projectView(const ViewGrid& grid, const CameraRig& rig, size_t camera_index);

}  // namespace vcharge
