#pragma once

#include <cstdint>
#include <memory>

#include "vcharge_core/camera/camera_rig.h"
#include "vcharge_simulation/vehicle/vehicle_body.h"

namespace vcharge {

/// Four 185-degree fisheye cameras (front, left, rear, right) on a VW Golf. Lens, attitude and height of the
/// left camera are those of the V-Charge car; the right camera mirrors it. Except for the left mounting,
/// lenses and mountings vary slightly with `seed`. `image_scale` is the image size relative to 1280x800. The
/// rig has no masks. Throws std::invalid_argument for a scale outside (0, 1].
CameraRig makeGolfRig(uint64_t seed, double image_scale);

/// Rotation from a camera to the vehicle whose optical axis has a yaw from straight ahead and a pitch below
/// the horizon, with level image rows.
Eigen::Matrix3d rotationTowards(double yaw_rad, double down_rad);

/// Body of the Golf that carries the cameras, dark and glossy.
std::shared_ptr<const VehicleBody> makeGolfBody();

/// The Golf in paint of a random brightness that reflects the scene, with a mirror housing behind each camera
/// at the side.
std::shared_ptr<const VehicleBody> makeGlossyBody(const CameraRig& rig, uint64_t seed);

/// The Golf's cameras set back from the outline of the car, so that bonnet, tailgate and doors fill more of
/// the images; otherwise as makeGolfRig.
CameraRig makeRecessedRig(uint64_t seed, double image_scale);

}  // namespace vcharge
