#pragma once

#include <cstdint>

#include "vcharge_core/base/options.h"
#include "vcharge_features/descriptor_matching.h"
#include "vcharge_reconstruction/mapping_data.h"

namespace vcharge {

struct LandmarkSearchOptions {
  double radius_px = 8.0;           ///< about where a landmark is expected, at 1280 pixels of width
  double max_distance_m = 10.0;     ///< between keyframes whose landmarks are looked for in each other
  double max_view_angle_rad = 0.6;  ///< between the directions from which a landmark is seen
  double max_range_ratio = 1.8;     ///< between the distances
  double max_merge_ratio = 1.25;    ///< between the distances of two landmarks that may be one
  double feature_sigma_px = 0.6;    ///< standard deviation of a feature's position
  MatchOptions matching = closeMatches();

  static MatchOptions closeMatches();

  template <class Visitor>
  void visitFields(Visitor&& visit) {
    visit("radius_px", radius_px);
    visit("max_distance_m", max_distance_m);
    visit("max_view_angle_rad", max_view_angle_rad);
    visit("max_range_ratio", max_range_ratio);
    visit("max_merge_ratio", max_merge_ratio);
    visit("feature_sigma_px", feature_sigma_px);
    visit("matching", matching);
  }
  void validate() const;  ///< throws std::invalid_argument naming the field
};

struct LandmarkSearchSummary {
  int64_t num_new_observations = 0;
  int64_t num_merged_tracks = 0;
};

/// Looks for landmarks in the images in which they should be seen by the keyframes' poses, of whatever camera
/// and whatever pass of a place, and adds the observations; two landmarks that turn out to be one are merged.
/// Data parallel, deterministic.
LandmarkSearchSummary searchLandmarks(const LandmarkSearchOptions& options, MappingData* data);

}  // namespace vcharge
