#pragma once

#include <cstdint>

#include "vcharge_core/camera/camera_rig.h"

namespace vcharge {

/// Four cameras with the names and image sizes of makeGolfRig, each within 10 cm and 10 degrees of the Golf's
/// of the same seed and never nearer to the car's body than that, with lenses of their own: Mei with xi from
/// 0.9 to 1.6 and 185 degrees of view, or Kannala-Brandt with 190 degrees. Every direction inside the field
/// of view has an image, and the image circle lies within the image's width. image_scale: size over 1280x800,
/// at most 1. Without masks. std::invalid_argument for a scale outside (0, 1].
CameraRig makeRandomRig(uint64_t seed, double image_scale);

}  // namespace vcharge
