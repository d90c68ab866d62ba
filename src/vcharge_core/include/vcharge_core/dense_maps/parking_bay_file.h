#pragma once

#include <string>

#include "vcharge_core/dense_maps/parking_bay.h"

namespace vcharge {

/// Writes bays as YAML: frame, content_hash, and of each bay id, row, kind, state, corners_m, entry_sigma_m,
/// end_sigma_m, confidence. Throws InputError naming the file if it cannot be written.
void writeParkingBays(const ParkingBays& bays, const std::string& path);

/// Reads the output of writeParkingBays(). Throws InputError naming the file and the key.
ParkingBays readParkingBays(const std::string& path);

}  // namespace vcharge
