#pragma once

#include <cstddef>
#include <memory>

#include "vcharge_core/base/options.h"
#include "vcharge_core/sparse_map/sparse_map.h"

namespace vcharge {

/// Options of summarizeMap().
struct SummaryOptions {
  VCHARGE_BEGIN_OPTIONS(SummaryOptions);
  VCHARGE_OPTION(double, max_sigma_factor, 2.0, atLeast(1.0),
                 "Largest deviation of a pose over that with all landmarks.");
  VCHARGE_OPTION(double, max_landmark_ratio, 1.0, above(0.0).upTo(1.0), "Largest part of landmarks to keep.");
  VCHARGE_OPTION(double, min_found_per_frame, 80.0, notNegative(),
                 "Least landmarks that a frame of another drive is expected to find at a keyframe.");
  VCHARGE_END_OPTIONS();
};

/// What a summary keeps.
struct SummaryReport {
  size_t num_landmarks_before = 0, num_landmarks = 0;
  /// Deviation of the position over that with all landmarks, of keyframes.
  double median_sigma_factor = 1.0, worst_sigma_factor = 1.0;
  /// The same as geometric mean, and what it is at least, whichever as many landmarks are chosen: how far the
  /// greedy choice can be from the best.
  double mean_sigma_factor = 1.0, least_sigma_factor = 1.0;
  /// Landmarks that a frame of another drive is expected to find at a keyframe, of the median keyframe.
  double median_num_found_before = 0.0, median_num_found = 0.0;
};

struct SummaryMap {
  std::shared_ptr<const SparseMap> map;
  SummaryReport report;
};

/// A map with as few landmarks as localization needs: at each keyframe, the covariance of a pose from the
/// landmarks in view stays below a bound, and another drive finds enough of them. Landmarks are chosen
/// greedily by how much they reduce the variances of the positions and raise the numbers of landmarks found
/// (their logarithms, so that all keyframes count alike), over all keyframes that observe them, each weighted
/// by the probability that another drive finds it: what several drives, or one over a long way, have seen
/// counts more. Ids stay. Deterministic.
SummaryMap summarizeMap(const SparseMap& map, const SummaryOptions& options);

}  // namespace vcharge
