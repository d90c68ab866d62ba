#pragma once

#include "vcharge_reconstruction/reconstruction_data.h"

namespace vcharge {

/// Sorts the observations of a track by image, and keeps the best one in each image.
void sortObservations(Track* track);

}  // namespace vcharge
