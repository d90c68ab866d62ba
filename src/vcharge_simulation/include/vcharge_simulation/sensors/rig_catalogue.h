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

}  // namespace vcharge
