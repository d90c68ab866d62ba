#pragma once

#include <cstddef>
#include <cstdint>
#include <map>
#include <memory>
#include <string>
#include <utility>
#include <vector>

#include <Eigen/Core>
#include <opencv2/core.hpp>

#include "vcharge_core/base/timestamp.h"
#include "vcharge_core/camera/camera_rig.h"
#include "vcharge_core/motion/rigid_transform.h"

namespace vcharge {

/// The vehicle's pose at an instant at which the images of all cameras went into the map.
struct MapKeyframe {
  Timestamp stamp;
  RigidTransform map_from_vehicle;
  /// Over [dt, dphi] in the map's frame: t = t_hat + dt, R = Exp(dphi) R_hat; zero where unknown.
  Eigen::Matrix<double, 6, 6> covariance = Eigen::Matrix<double, 6, 6>::Zero();
};

/// A point of the world.
struct MapLandmark {
  Eigen::Vector3d position_m = Eigen::Vector3d::Zero();     ///< in the map's frame
  Eigen::Matrix3d covariance_m2 = Eigen::Matrix3d::Zero();  ///< zero where unknown
};

/// Where a camera saw a landmark. Members are indices into the map's keyframes and landmarks and the rig's
/// cameras.
struct MapObservation {
  int32_t keyframe = 0;
  int32_t camera = 0;
  int32_t landmark = 0;
  Eigen::Vector2f position_px = Eigen::Vector2f::Zero();
};

/// A place that was passed twice, and what became of this loop edge.
struct MapLoopEdge {
  int32_t first = 0;  ///< keyframes
  int32_t second = 0;
  RigidTransform first_from_second;  ///< as measured
  int32_t num_inliers = 0;
  bool accepted = false;
  std::string reason;  ///< why it was rejected; empty where accepted
};

/// What a SparseMap is made of. Plain data; the map checks it.
struct SparseMapContents {
  CameraRig rig;                       ///< with extrinsics
  std::vector<MapKeyframe> keyframes;  ///< stamps strictly increasing
  std::vector<MapLandmark> landmarks;
  std::vector<MapObservation> observations;  ///< any order; at most one per keyframe, camera and landmark
  /// Row i describes observation i: CV_8UC1 or CV_32FC1, all of one kind.
  cv::Mat descriptors;
  std::vector<MapLoopEdge> loop_edges;
  std::string feature_options;  ///< YAML of the extractor's options that made the descriptors
  std::string vocabulary;       ///< bytes of the vocabulary tree that recognizes places; may be empty
  double odometry_distance_scale = 1.0;  ///< true over counted distance of the drive's odometer
  double odometry_turn_scale = 1.0;      ///< true over counted turn
};

/// A metric map of landmarks, frozen once built, shared as shared_ptr<const SparseMap>. Its frame is that of
/// the first keyframe's vehicle, unless it was placed elsewhere. Observations are ordered by keyframe, camera
/// and landmark.
class SparseMap {
 public:
  /// std::invalid_argument naming the member for contents that do not fit together: indices out of range,
  /// numbers that are not finite, stamps that do not increase, a rig without extrinsics, landmarks without
  /// observation, descriptors of another count or type.
  explicit SparseMap(SparseMapContents contents);

  const CameraRig& rig() const { return contents_.rig; }
  const std::vector<MapKeyframe>& keyframes() const { return contents_.keyframes; }
  const std::vector<MapLandmark>& landmarks() const { return contents_.landmarks; }
  const std::vector<MapObservation>& observations() const { return contents_.observations; }
  const cv::Mat& descriptors() const { return contents_.descriptors; }
  const SparseMapContents& contents() const { return contents_; }

  /// Observations [first, second) of one camera at one keyframe.
  std::pair<size_t, size_t> observationsOf(size_t keyframe, size_t camera) const;
  /// Indices of the observations of a landmark, ascending.
  std::pair<const int32_t*, const int32_t*> observationsOfLandmark(size_t landmark) const;

  /// Over all of the contents: the same on any number of threads.
  std::string contentHash() const;

 private:
  SparseMapContents contents_;
  std::vector<size_t> begin_of_image_;     // keyframe * cameras + camera; one more than images
  std::vector<size_t> begin_of_landmark_;  // into observations_by_landmark_
  std::vector<int32_t> observations_by_landmark_;
};

/// How a map came to be: never part of its content hash.
using MapProvenance = std::map<std::string, std::string>;

}  // namespace vcharge
