#include "vcharge_core/dense_maps/range_map.h"

#include "files/pixel_hash.h"

namespace vcharge {

void addToHash(const RangeMap& map, ContentHasher* hasher) {
  hasher->add(map.stamp.nanoseconds());
  hasher->add(map.camera_name);
  hasher->add(map.frame_id);
  const MeiCamera::Parameters parameters = map.camera.parameters();
  for (int i = 0; i < MeiCamera::kNumParameters; ++i) {
    hasher->add(parameters[i]);
  }
  addPixelsToHash(map.range_m, hasher);
  addPixelsToHash(map.standard_deviation_m, hasher);
  addPixelsToHash(map.confidence, hasher);
}

}  // namespace vcharge
