#pragma once

#include <cstdint>
#include <memory>

#include "vcharge_core/camera/camera_rig.h"
#include "vcharge_simulation/vehicle/vehicle_body.h"

namespace vcharge {

/// Four 185-degree fisheye cameras (front, left, rear, right) as a VW Golf carries them: the lens and the
/// attitude and height of the left one are those of a real car (V-Charge), the right one is its mirror image;
/// each lens and each mounting but the left one's differs a little by `seed`. image_scale: size over
/// 1280x800, at most 1. Without masks. std::invalid_argument for a scale outside (0, 1].
CameraRig makeGolfRig(uint64_t seed, double image_scale);

/// The body of the Golf that carries the cameras, dark and glossy.
std::shared_ptr<const VehicleBody> makeGolfBody();

}  // namespace vcharge
