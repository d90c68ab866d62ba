#pragma once

#include <deque>
#include <vector>

#include <Eigen/Core>
#include <opencv2/core.hpp>

#include "vcharge_core/base/timestamp.h"
#include "vcharge_core/camera/working_camera.h"
#include "vcharge_core/motion/rigid_transform.h"
#include "vcharge_features/patch_tracker.h"

namespace vcharge {

/// An image position of a followed point.
struct PointObservation {
  Timestamp stamp;
  cv::Point2f position_px;
  Eigen::Vector3d ray_in_camera;  ///< unit
};

/// The latest observations of one point, oldest first.
using PointTrack = std::deque<PointObservation>;

/// Follows image points of one camera that may belong to objects beside the vehicle: all textured points
/// except high above the horizon. New points fill the cells of the image that have none. Deterministic.
class FollowedPoints {
 public:
  /// Observations older than this are dropped.
  static constexpr double kHistory_s = 0.42;

  FollowedPoints(const WorkingCamera& camera, const RigidTransform& vehicle_from_camera);

  /// Follows the points into the next image (CV_8UC1 of the working camera). `previous_from_now` is the
  /// motion of the vehicle, with which new points on the ground are predicted.
  void add(Timestamp stamp, const cv::Mat& image, const RigidTransform& previous_from_now);
  /// Points observed in the last image.
  const std::vector<PointTrack>& tracks() const { return tracks_; }
  void clear();

 private:
  cv::Point2f predict(const PointTrack& track, Timestamp stamp,
                      const RigidTransform& now_from_previous) const;
  void startTracks(Timestamp stamp, const cv::Mat& image);

  const WorkingCamera camera_;
  const RigidTransform vehicle_from_camera_;
  const PatchTracker tracker_;
  cv::Mat region_;         // CV_8UC1: not 0 where points are followed
  cv::Mat is_start_cell_;  // CV_8UC1: not 0 in cells in which points start
  ImagePyramid pyramid_;
  std::vector<PointTrack> tracks_;
};

}  // namespace vcharge
