#pragma once

#include "vcharge_core/base/options.h"
#include "vcharge_reconstruction/bundle_adjustment.h"

namespace vcharge {

/// Options of the joint adjustment of cameras, poses and landmarks.
struct RigAdjustmentOptions {
  double max_ground_distance_m = 0.05;  ///< of ground points from where the ground was found before
  /// Of a ground point from the plane on which the vehicle stands: more than the ground is rough, since what
  /// is wrong with neighbouring points goes together.
  double ground_sigma_m = 0.1;
  double segment_m = 10.0;  ///< parts of the drive whose errors are independent of each other
  // What all parts of a drive have in common, so that a jackknife does not see it: how patches look different
  // from elsewhere, and lenses that are not quite as their models say.
  double common_error_px = 0.05;  ///< standard deviation, of directions
  double common_range_m = 5.0;    ///< at which it moves a camera's place: the usual range of landmarks
  BundleAdjustmentOptions bundle;

  template <class Visitor>
  void visitFields(Visitor&& visit) {
    visit("max_ground_distance_m", max_ground_distance_m);
    visit("ground_sigma_m", ground_sigma_m);
    visit("segment_m", segment_m);
    visit("common_error_px", common_error_px);
    visit("common_range_m", common_range_m);
    visit("bundle", bundle);
  }
  void validate() const;  ///< throws std::invalid_argument naming the field
};

}  // namespace vcharge
