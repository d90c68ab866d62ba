#pragma once

#include "vcharge_core/base/options.h"
#include "vcharge_features/patch_tracker.h"
#include "vcharge_features/rectified_view.h"

namespace vcharge {

/// Options of the search for landmarks of one camera in the images of its neighbours.
struct InterCameraOptions {
  bool enabled = true;
  double history_m = 3.0;  ///< of travel, in which the other camera may have seen the same
  int num_views = 2;       ///< of the history, those of greatest overlap
  int keyframe_step = 2;   ///< every so many keyframes
  int min_overlap = 15;    ///< landmarks that both images should show
  // Between the directions from which a landmark is seen, and the distances.
  double max_view_angle_rad = 0.5;
  double max_range_ratio = 1.5;
  double max_shift_px = 8.0;  ///< in the view, from where a landmark is expected
  double sigma_px = 0.5;      ///< standard deviation of a position found
  RectifiedViewCacheOptions views = smallViews();
  PatchTrackerOptions patches = singleLevelPatches();

  static RectifiedViewCacheOptions smallViews();
  static PatchTrackerOptions singleLevelPatches();

  template <class Visitor>
  void visitFields(Visitor&& visit) {
    visit("enabled", enabled);
    visit("history_m", history_m);
    visit("num_views", num_views);
    visit("keyframe_step", keyframe_step);
    visit("min_overlap", min_overlap);
    visit("max_view_angle_rad", max_view_angle_rad);
    visit("max_range_ratio", max_range_ratio);
    visit("max_shift_px", max_shift_px);
    visit("sigma_px", sigma_px);
    visit("views", views);
    visit("patches", patches);
  }
  void validate() const;  ///< throws std::invalid_argument naming the field
};

}  // namespace vcharge
