#pragma once

#include <cstdint>

#include "vcharge_core/base/options.h"
#include "vcharge_reconstruction/reconstruction_data.h"

namespace vcharge {

struct LandmarkSearchOptions {
  VCHARGE_BEGIN_OPTIONS(LandmarkSearchOptions);
  VCHARGE_OPTION(double, radius_px, 8.0, positive(), "Search radius in an image 1280 pixels wide.");
  VCHARGE_OPTION(double, max_distance_m, 10.0, positive(), "Distance of keyframes that share landmarks.");
  VCHARGE_OPTION(double, feature_sigma_px, 0.6, positive(), "Deviation of a feature's position.");
  VCHARGE_END_OPTIONS();
};

struct LandmarkSearchSummary {
  int64_t num_new_observations = 0;
  int64_t num_merged_tracks = 0;
};

/// Searches for landmarks in all images, of any camera and visit, in which the poses predict them; adds the
/// observations; merges two landmarks that share a feature. Keyframes before `first_of_new` are not compared
/// with each other: they were searched before. Data parallel, deterministic.
LandmarkSearchSummary searchLandmarks(const LandmarkSearchOptions& options, ReconstructionData* data,
                                      int32_t first_of_new = 0);

/// The same between keyframes before `first_of_new` and those from it on, where each side was searched
/// before.
LandmarkSearchSummary searchLandmarksBetween(const LandmarkSearchOptions& options, int32_t first_of_new,
                                             ReconstructionData* data);

}  // namespace vcharge
