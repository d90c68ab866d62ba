#pragma once

#include <cstdint>
#include <memory>

#include "vcharge_core/sparse_map/sparse_map.h"
#include "vcharge_reconstruction/map_localizer.h"

namespace vcharge::testing {

struct TestMapOptions {
  int num_keyframes = 24;
  int num_landmarks = 3000;
  /// Distance along x of an indistinguishable copy of the map; 0: no copy.
  double twin_offset_m = 0.0;
  uint32_t seed = 1;
};

/// The analytic map of vcharge_core with a random descriptor per landmark.
std::shared_ptr<const SparseMap> makeTestMap(const TestMapOptions& options);

struct TestViewOptions {
  double noise_px = 0.3;
  double wrong_ratio = 0.0;  ///< fraction of the features with another landmark's descriptor
  double max_range_m = 20.0;
  int camera_without_image = -1;
  uint32_t seed = 7;
};

/// Features of the map's landmarks from a pose, with 8 of 256 bits of every descriptor flipped.
RigFeatures makeTestView(const SparseMap& map, const RigidTransform& map_from_vehicle,
                         const TestViewOptions& options);

/// The first 128 bits of binary descriptors as numbers (CV_32FC1, 128 columns), 0 or `one` each.
cv::Mat descriptorsAsNumbers(const cv::Mat& descriptors, float one);

/// Features at random positions with random descriptors.
RigFeatures makeForeignView(const SparseMap& map, uint32_t seed);

}  // namespace vcharge::testing
