#pragma once

#include <memory>
#include <vector>

#include "map_pose/landmark_view.h"
#include "vcharge_core/camera/camera_rig.h"
#include "vcharge_features/descriptor_matching.h"
#include "vcharge_features/place_index.h"
#include "vcharge_geometry/solvers/point_match.h"
#include "vcharge_reconstruction/map_localizer.h"
#include "vcharge_reconstruction/tiled_map.h"

namespace vcharge {

/// Matches of features with landmarks, some of them wrong, and the same as input of the estimator.
struct LandmarkMatches {
  std::vector<LandmarkObservation> observations;
  std::vector<PointMatch> points;

  void append(const LandmarkMatches& other);
};

/// Matches a map's landmarks with a rig's features, near an expected pose or at a recognized place.
/// Immutable.
class LandmarkMatcher {
 public:
  LandmarkMatcher(std::shared_ptr<const TiledMap> map, std::shared_ptr<const CameraRig> rig,
                  const MapLocalizerOptions& options);

  /// Searches around the projections of the landmarks; the deviations are those of `map_from_vehicle`.
  LandmarkMatches searchNear(const RigFeatures& features, const RigidTransform& map_from_vehicle,
                             double sigma_m, double sigma_rad) const;

  /// Searches the whole images for landmarks that the place's cameras (see PlaceMatch) saw at that keyframe
  /// and its neighbours.
  LandmarkMatches searchAtPlace(const RigFeatures& features, const PlaceMatch& place) const;

 private:
  cv::Mat descriptorsOf(const std::vector<TileObservation>& observations) const;
  /// What a camera saw at a keyframe and its neighbours; `tiles` keeps the observations alive.
  std::vector<TileObservation> observationsAround(size_t keyframe, size_t camera,
                                                  std::vector<KeyframeInTile>* tiles) const;
  void add(const RigFeatures& features, size_t camera, const TileObservation& observation, int feature,
           float distance, LandmarkMatches* matches) const;

  const std::shared_ptr<const TiledMap> map_;
  const std::shared_ptr<const CameraRig> rig_;
  const MapLocalizerOptions options_;
  MatchOptions matching_;  // with a distance for the map's kind of descriptor
};

}  // namespace vcharge
