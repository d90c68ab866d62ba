#pragma once

#include <string>
#include <vector>

#include "vcharge_core/base/options.h"
#include "vcharge_core/dense_maps/parking_bay.h"

namespace vcharge {

template <>
inline std::vector<std::string> enumNames<BayKind>() {
  return {"perpendicular", "angled", "parallel"};
}
template <>
inline std::vector<std::string> enumNames<BayState>() {
  return {"free", "occupied", "unknown"};
}

/// Writes bays as YAML: frame, content_hash, and of each bay id, row, kind, state, corners_m, entry_sigma_m,
/// end_sigma_m, confidence. Throws InputError naming the file if it cannot be written.
void writeParkingBays(const ParkingBays& bays, const std::string& path);

/// Reads the output of writeParkingBays(). Throws InputError naming the file and the key.
ParkingBays readParkingBays(const std::string& path);

}  // namespace vcharge
