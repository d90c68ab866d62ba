#pragma once

#include <cstdint>

#include "vcharge_core/camera/camera_rig.h"

namespace vcharge {

/// Four cameras with the names and image sizes of makeGolfRig, each within 10 cm and 10 degrees of the Golf's
/// camera for the same seed and never closer to the body. Lenses are Mei with xi from 0.9 to 1.6 and a field
/// of view of 185 degrees, or Kannala-Brandt with 190 degrees. Every direction inside the field of view
/// projects, and the image circle fits the image width. `image_scale` is the image size relative to 1280x800.
/// The rig has no masks. Throws std::invalid_argument for a scale outside (0, 1].
CameraRig makeRandomRig(uint64_t seed, double image_scale);

}  // namespace vcharge
