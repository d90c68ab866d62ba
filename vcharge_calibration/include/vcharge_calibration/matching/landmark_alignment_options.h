#pragma once

#include "vcharge_core/base/options.h"
#include "vcharge_features/patch_alignment.h"

namespace vcharge {

/// Options of the alignment of all that was seen of a landmark with one patch of it.
struct LandmarkAlignmentOptions {
  bool enabled = true;
  double max_shift_px = 2.0;        ///< from where the landmark was seen
  double sigma_px = 0.3;            ///< standard deviation of an aligned position
  double unaligned_sigma_px = 0.8;  ///< at least, of one that could not be aligned
  PatchAlignmentOptions patches = uncertainShapes();

  static PatchAlignmentOptions uncertainShapes();

  template <class Visitor>
  void visitFields(Visitor&& visit) {
    visit("enabled", enabled);
    visit("max_shift_px", max_shift_px);
    visit("sigma_px", sigma_px);
    visit("unaligned_sigma_px", unaligned_sigma_px);
    visit("patches", patches);
  }
  void validate() const;  ///< throws std::invalid_argument naming the field
};

}  // namespace vcharge
