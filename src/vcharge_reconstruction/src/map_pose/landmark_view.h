#pragma once

#include <cstddef>
#include <vector>

#include <opencv2/core.hpp>

#include "vcharge_core/camera/camera_rig.h"
#include "vcharge_core/sparse_map/sparse_map.h"
#include "vcharge_reconstruction/map_localizer.h"
#include "vcharge_reconstruction/tiled_map.h"

namespace vcharge {

/// An observation in a tile of a map, which must outlive this.
struct TileObservation {
  const SparseMap* tile = nullptr;
  size_t index = 0;

  const MapObservation& get() const { return tile->observations()[index]; }
  const MapLandmark& landmark() const { return tile->landmarks()[static_cast<size_t>(get().landmark)]; }
  /// Drives in the tile that saw the landmark.
  int32_t numDrives() const;
  cv::Mat descriptor() const { return tile->descriptors().row(static_cast<int>(index)); }
};

/// Landmarks that a camera should see, each with the observation from the most similar direction of every
/// drive: a landmark looks different by day and by night.
struct ExpectedLandmarks {
  std::vector<TileObservation> observations;
  std::vector<cv::Point2f> positions_px;  ///< expected positions in the camera's image
  std::vector<double> ranges_m;
};

/// The landmarks of a map that a rig should see from a pose. All arguments must outlive this object, and this
/// object the observations.
class LandmarkView {
 public:
  LandmarkView(const TiledMap& map, const CameraRig& rig, const MapLocalizerOptions& options,
               const RigidTransform& map_from_vehicle, const FrameMotion& motion);

  ExpectedLandmarks expectedIn(size_t camera) const;

 private:
  struct Source {
    TileObservation observation;
    double cos_angle;  ///< between the directions of the observation and the expected view
  };
  std::vector<Source> sourcesFor(const Eigen::Vector3d& camera_centre) const;

  const TiledMap& map_;
  const CameraRig& rig_;
  const RigidTransform& map_from_vehicle_;
  const FrameMotion& motion_;
  std::vector<KeyframeInTile> keyframes_;  ///< the nearest keyframes
};

}  // namespace vcharge
