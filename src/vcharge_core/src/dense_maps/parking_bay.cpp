#include "vcharge_core/dense_maps/parking_bay.h"

namespace vcharge {

void addToHash(const ParkingBays& bays, ContentHasher* hasher) {
  hasher->add(bays.frame_id);
  for (const ParkingBay& bay : bays.bays) {
    for (const int64_t value : {static_cast<int64_t>(bay.id), static_cast<int64_t>(bay.row),
                                static_cast<int64_t>(bay.kind), static_cast<int64_t>(bay.state)}) {
      hasher->add(value);
    }
    for (const Eigen::Vector2d& corner_m : bay.corners_m) {
      hasher->add(corner_m.x());
      hasher->add(corner_m.y());
    }
    for (const double value : {bay.entry_sigma_m, bay.end_sigma_m, bay.confidence}) {
      hasher->add(value);
    }
  }
}

}  // namespace vcharge
