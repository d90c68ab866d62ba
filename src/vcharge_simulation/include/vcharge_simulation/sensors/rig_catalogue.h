#pragma once

#include <cstdint>
#include <string>
#include <vector>

#include "vcharge_core/camera/camera_rig.h"
#include "vcharge_simulation/scenes/scene_catalogue.h"

namespace vcharge {

/// Name and one-line description of each rig.
std::vector<CatalogueEntry> listRigs();

/// A rig of the catalogue, without masks; the same arguments give the same rig. `image_scale` is the image
/// size relative to 1280x800. Throws std::invalid_argument for an unknown name, listing the known ones, and
/// for a scale outside (0, 1].
CameraRig makeRig(const std::string& name, uint64_t seed, double image_scale);

/// Four cameras with the names and image sizes of makeGolfRig, each within 10 cm and 10 degrees of the Golf's
/// camera for the same seed and never closer to the body. Lenses are Mei with xi from 0.9 to 1.6 and a field
/// of view of 185 degrees, or Kannala-Brandt with 190 degrees. Every direction inside the field of view
/// projects, and the image circle fits the image width. `image_scale` is the image size relative to 1280x800.
/// The rig has no masks. Throws std::invalid_argument for a scale outside (0, 1].
CameraRig makeRandomRig(uint64_t seed, double image_scale);

/// The four cameras of makeGolfRig and four more of other kinds, varied slightly by `seed`: `roof`, a pinhole
/// camera above the windscreen; `trailer`, a Kannala-Brandt camera of 130 degrees that looks down behind the
/// car; `left_pillar` and `right_pillar`, pinhole cameras that look back along the sides and share no view
/// with each other. The rig has no masks. Throws std::invalid_argument for a scale outside (0, 1].
CameraRig makeEightRig(uint64_t seed, double image_scale);

}  // namespace vcharge
