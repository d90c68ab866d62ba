#pragma once

#include <memory>
#include <vector>

#include "vcharge_core/camera/camera_rig.h"
#include "vcharge_core/sparse_map/sparse_map.h"
#include "vcharge_features/place_index.h"
#include "vcharge_geometry/solvers/point_match.h"
#include "vcharge_reconstruction/map_localizer.h"

namespace vcharge {

/// Sightings of landmarks, right and wrong ones, and the same for the estimator.
struct LandmarkMatches {
  std::vector<LandmarkSighting> sightings;
  std::vector<PointMatch> points;

  void append(const LandmarkMatches& other);
};

/// Finds a map's landmarks among a rig's features, where they are expected or at a place that was recognized.
/// Immutable.
class LandmarkMatcher {
 public:
  LandmarkMatcher(std::shared_ptr<const SparseMap> map, std::shared_ptr<const CameraRig> rig,
                  const MapLocalizerOptions& options);

  /// Where a rig at `map_from_vehicle`, known to the sigmas, should see them.
  LandmarkMatches searchNear(const RigFeatures& features, const RigidTransform& map_from_vehicle,
                             double sigma_m, double sigma_rad) const;

  /// Anywhere in the images, among what the place's cameras (see PlaceMatch) saw there and just beside.
  LandmarkMatches searchAtPlace(const RigFeatures& features, const PlaceMatch& place) const;

  /// Median distance between descriptors of two landmarks: what a match by chance is like.
  double unrelatedDistance() const { return unrelated_distance_; }

 private:
  cv::Mat descriptorsOf(const std::vector<size_t>& observations) const;
  std::vector<size_t> observationsAround(size_t keyframe, size_t camera) const;
  void add(const RigFeatures& features, size_t camera, size_t observation, int feature, float distance,
           LandmarkMatches* matches) const;

  const std::shared_ptr<const SparseMap> map_;
  const std::shared_ptr<const CameraRig> rig_;
  const MapLocalizerOptions options_;
  const double unrelated_distance_;
  MatchOptions matching_;  // the options' with a distance of the map's kind of descriptor
};

}  // namespace vcharge
