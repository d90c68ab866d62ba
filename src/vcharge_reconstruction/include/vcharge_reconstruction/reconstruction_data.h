#pragma once

#include <cstdint>
#include <memory>
#include <optional>
#include <vector>

#include <Eigen/Core>

#include "vcharge_core/base/timestamp.h"
#include "vcharge_core/camera/camera_rig.h"
#include "vcharge_core/camera/moving_camera.h"
#include "vcharge_core/motion/rigid_transform.h"
#include "vcharge_core/sparse_map/sparse_map.h"
#include "vcharge_features/image_features.h"

namespace vcharge {

/// Features of one camera at a keyframe.
struct KeyframeImage {
  ImageFeatures features;
  Eigen::Matrix3Xd rays_in_camera;        ///< bearings of the features
  std::vector<int32_t> track_of_feature;  ///< -1: none
};

/// The vehicle at an instant that becomes part of the map.
struct Keyframe {
  Timestamp stamp;
  RigidTransform odom_from_vehicle;   ///< pose counted by the odometer
  RigidTransform map_from_vehicle;    ///< estimated
  FrameMotion motion;                 ///< counted by the odometer
  double travelled_m = 0.0;           ///< distance by the odometer, since the start of the drive
  std::vector<KeyframeImage> images;  ///< in the rig's order; without features where an image is missing
  int32_t session = 0;                ///< index of the session
  int32_t map_id = kNoId;             ///< its id in an existing map
};

/// Deviation of observations that show their landmark, but not precisely: they are kept for their looks, and
/// count little.
inline constexpr double kImpreciseSigma_px = 2.5;

/// A camera at a keyframe.
inline MovingCamera cameraAt(const Keyframe& keyframe, const CameraRig& rig, size_t camera) {
  return {rig.cameras[camera], keyframe.map_from_vehicle, keyframe.motion.of(camera)};
}

/// Observation of a track in an image of a keyframe.
struct TrackObservation {
  int32_t keyframe = 0;
  int32_t camera = 0;
  int32_t feature = -1;  ///< the image's feature that describes it; -1: none
  Eigen::Vector2d position_px = Eigen::Vector2d::Zero();
  double sigma_px = 1.0;
};

/// Observations of one scene point; a landmark once it has a position.
struct Track {
  std::vector<TrackObservation> observations;  ///< in order of keyframes
  std::optional<Eigen::Vector3d> position_m;   ///< in the map; absent where it was not triangulated
  Eigen::Matrix3d covariance_m2 = Eigen::Matrix3d::Zero();
  int32_t joined_to = -1;          ///< the track that has its observations now; -1: itself
  int32_t map_id = kNoId;          ///< its id in an existing map
  double presence_log_odds = 0.0;  ///< as in MapLandmark
};

/// Rig, keyframes and tracks of a reconstruction.
struct ReconstructionData {
  std::shared_ptr<const CameraRig> rig;
  std::vector<MapSession> sessions = {MapSession()};
  std::vector<Keyframe> keyframes;  ///< grouped by session
  std::vector<Track> tracks;
  double odometry_distance_scale = 1.0;  ///< ratio of true to counted distance
  double odometry_turn_scale = 1.0;      ///< ratio of true to counted turn
  // As in SparseMapContents.
  int32_t next_keyframe_id = 0;
  int32_t next_landmark_id = 0;
};

}  // namespace vcharge
