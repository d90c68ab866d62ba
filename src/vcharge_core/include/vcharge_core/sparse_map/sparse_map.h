#pragma once

#include <cstddef>
#include <cstdint>
#include <memory>
#include <string>
#include <utility>
#include <vector>

#include <Eigen/Core>
#include <opencv2/core.hpp>

#include "vcharge_core/base/timestamp.h"
#include "vcharge_core/camera/camera_rig.h"
#include "vcharge_core/motion/rigid_transform.h"
#include "vcharge_core/motion/trajectory.h"

namespace vcharge {

/// One drive in a map.
struct MapSession {
  std::string name;            ///< of the recording; empty if unknown
  std::string recording_hash;  ///< of the recording's file; empty if unknown
  /// Sessions with one number were joined at common places. Components lie side by side in the map frame;
  /// their relative pose is unknown.
  int32_t component = 0;
};

/// An id that is not assigned yet: SparseMap's constructor does.
constexpr int32_t kNoId = -1;

/// Pose of the vehicle at an instant whose images are part of the map.
struct MapKeyframe {
  Timestamp stamp;
  RigidTransform map_from_vehicle;
  /// Covariance over [dt, dphi] in the map frame: t = t_hat + dt, R = Exp(dphi) R_hat; zero if unknown.
  Eigen::Matrix<double, 6, 6> covariance = Eigen::Matrix<double, 6, 6>::Zero();
  int32_t session = 0;  ///< index of the session
  int32_t id = kNoId;   ///< the same in all versions of a map
};

/// A 3D point.
struct MapLandmark {
  Eigen::Vector3d position_m = Eigen::Vector3d::Zero();     ///< in the map frame
  Eigen::Matrix3d covariance_m2 = Eigen::Matrix3d::Zero();  ///< zero if unknown
  int32_t id = kNoId;                                       ///< the same in all versions of a map
  /// Evidence of later drives that the point is still there, as the logarithm of odds; 0 without any.
  double presence_log_odds = 0.0;
};

/// An observation of a landmark in an image. Members are indices into the map's keyframes and landmarks and
/// the rig's cameras.
struct MapObservation {
  int32_t keyframe = 0;
  int32_t camera = 0;
  int32_t landmark = 0;
  Eigen::Vector2f position_px = Eigen::Vector2f::Zero();
};

/// A loop closure candidate: two keyframes at the same location, and whether it was accepted.
struct MapLoopEdge {
  int32_t first = 0;  ///< indices of keyframes
  int32_t second = 0;
  RigidTransform first_from_second;  ///< measured transform, before optimization
  int32_t num_inliers = 0;
  bool accepted = false;
  std::string reason;  ///< reason of the rejection; empty if accepted
};

/// Content of a SparseMap. Plain data; the constructor of SparseMap checks it.
struct SparseMapContents {
  CameraRig rig;  ///< with extrinsics
  std::vector<MapSession> sessions = {MapSession()};
  /// Grouped by session, in order; stamps strictly increase within a session, ids over all of them.
  std::vector<MapKeyframe> keyframes;
  std::vector<MapLandmark> landmarks;        ///< ids strictly increase
  std::vector<MapObservation> observations;  ///< in any order; at most one per keyframe, camera and landmark
  /// Row i describes observation i. CV_8UC1 or CV_32FC1.
  cv::Mat descriptors;
  std::vector<MapLoopEdge> loop_edges;
  std::string feature_options;           ///< YAML of the options of the extractor that made the descriptors
  double odometry_distance_scale = 1.0;  ///< true distance over the distance counted by the odometer
  double odometry_turn_scale = 1.0;      ///< true turn over counted turn
  // The ids that new keyframes and landmarks get: no earlier version of the map has used them.
  int32_t next_keyframe_id = 0;
  int32_t next_landmark_id = 0;
};

/// An immutable metric map of landmarks, shared as shared_ptr<const SparseMap>. Its frame is the vehicle
/// frame at the first keyframe, unless the map was transformed. Observations are ordered by keyframe, camera
/// and landmark.
class SparseMap {
 public:
  /// Throws std::invalid_argument naming the member for inconsistent contents: indices out of range, numbers
  /// that are not finite, stamps or ids that do not increase, a rig without extrinsics, landmarks without an
  /// observation, descriptors of another count or type.
  explicit SparseMap(SparseMapContents contents);

  const CameraRig& rig() const { return contents_.rig; }
  const std::vector<MapSession>& sessions() const { return contents_.sessions; }
  const std::vector<MapKeyframe>& keyframes() const { return contents_.keyframes; }
  const std::vector<MapLandmark>& landmarks() const { return contents_.landmarks; }
  const std::vector<MapObservation>& observations() const { return contents_.observations; }
  const cv::Mat& descriptors() const { return contents_.descriptors; }
  const SparseMapContents& contents() const { return contents_; }

  /// Range [first, second) of the observations in one camera at one keyframe.
  std::pair<size_t, size_t> observationsOf(size_t keyframe, size_t camera) const;
  /// Indices of the observations of a landmark, in ascending order.
  std::pair<const int32_t*, const int32_t*> observationsOfLandmark(size_t landmark) const;

  /// Hash of all contents; does not depend on the number of threads.
  std::string contentHash() const;
  /// The same without sessions, ids and evidence, as in files of before there were any.
  std::string contentHashWithoutSessions() const;

 private:
  std::string hash(bool with_sessions) const;

  SparseMapContents contents_;
  std::vector<size_t> begin_of_image_;     // index keyframe * cameras + camera, plus the end
  std::vector<size_t> begin_of_landmark_;  // indices into observations_by_landmark_
  std::vector<int32_t> observations_by_landmark_;
};

/// Poses of the keyframes, in order of their stamps.
Trajectory trajectoryOf(const SparseMap& map);

}  // namespace vcharge
