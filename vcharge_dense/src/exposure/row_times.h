#pragma once

#include <cstddef>

#include "vcharge_core/camera/mei_camera.h"
#include "vcharge_dense/exposure.h"

namespace vcharge {

/// ExposureTimes::at() of a row of positions in the image, in single precision.
void exposureTimesOfRow(const MeiCamera& camera, const ExposureTimes& times, const float* u, const float* v,
                        size_t count, float* time_s);

}  // namespace vcharge
