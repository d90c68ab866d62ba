#pragma once

#include <mutex>
#include <optional>

#include "vcharge_core/base/timestamp.h"
#include "vcharge_core/dense_maps/range_map.h"
#include "vcharge_dense/plane_sweep.h"

namespace vcharge {

/// The last range map of one camera, which predicts the next one. Thread safe.
class RangeMemory {
 public:
  /// The last range map if it was taken shortly before this stamp.
  std::optional<RememberedRanges> before(Timestamp stamp) const {
    constexpr double kMaxAge_s = 0.5;
    const std::lock_guard<std::mutex> lock(mutex_);
    const double age_s = toSeconds(stamp - stamp_);
    return last_.range_m.empty() || !(age_s > 0.0) || age_s > kMaxAge_s ? std::nullopt : std::optional(last_);
  }

  void keep(const RangeMap& map, const RigidTransform& world_from_camera) {
    const std::lock_guard<std::mutex> lock(mutex_);
    last_ = {map.range_m, world_from_camera, last_.num_sweeps + 1};
    stamp_ = map.stamp;
  }

  void clear() {
    const std::lock_guard<std::mutex> lock(mutex_);
    last_ = {};
  }

 private:
  mutable std::mutex mutex_;
  RememberedRanges last_;
  Timestamp stamp_;
};

}  // namespace vcharge
