#pragma once

#include <cstdint>
#include <map>
#include <memory>
#include <vector>

#include <Eigen/Core>
#include <opencv2/core.hpp>

#include "vcharge_core/base/options.h"
#include "vcharge_core/camera/camera_rig.h"
#include "vcharge_core/frames/image.h"
#include "vcharge_core/motion/rigid_transform.h"
#include "vcharge_features/feature_extractor.h"
#include "vcharge_features/patch_alignment.h"
#include "vcharge_features/patch_tracker.h"
#include "vcharge_geometry/solvers/ray_match.h"
#include "vcharge_reconstruction/reconstruction_data.h"

namespace vcharge {

struct FrameTrackerOptions {
  VCHARGE_BEGIN_OPTIONS(FrameTrackerOptions);
  VCHARGE_OPTION(int, max_tracks_per_camera, 350, atLeast(10), "Points tracked at once in one camera.");
  VCHARGE_OPTION(double, min_spacing_px, 20.0, atLeast(2.0),
                 "Spacing of tracks in an image 1280 pixels wide.");
  VCHARGE_OPTION(double, tracking_sigma_px, 0.1, above(0.0).below(10.0),
                 "Deviation of a tracked position in addition to that of its patch's alignment.");
  VCHARGE_END_OPTIONS();
};

/// A point tracked in one camera.
struct LiveTrack {
  int32_t track = -1;  ///< index into ReconstructionData::tracks; -1: begins at this keyframe
  cv::Point2f position_px;
  Eigen::Vector3d ray_in_camera;
  cv::Point2f last_step_px = {0.0F, 0.0F};  ///< motion from the previous image
  cv::Point2f keyframe_px;                  ///< position in the last keyframe
  int32_t anchor_keyframe = 0;              ///< keyframe whose image has the reference patch, the anchor
  cv::Point2f anchor_px;
  double drift_variance_px2 = 0.0;  ///< of the anchor from the point where the track began
  double alignment_sigma_px = 0.0;  ///< of the position in the last keyframe, from the anchor
  /// Deformation of the patch from where the track began to the anchor, and from there to the last keyframe.
  Eigen::Matrix2d anchor_shape = Eigen::Matrix2d::Identity();
  Eigen::Matrix2d shape = Eigen::Matrix2d::Identity();

  /// Begins a new track with the patch at the present position in a keyframe.
  void begin(int32_t keyframe);
  /// Makes the patch at a position in a keyframe the anchor, which lies about `sigma_px` off the last one.
  void moveAnchor(int32_t keyframe, cv::Point2f there_px, double sigma_px);
};

/// Tracks the points of one camera through its images. At keyframes each patch is aligned with its anchor,
/// including its shape, so that it does not drift; where its looks have changed too much, with the last
/// keyframe's patch, which becomes the anchor. With each further anchor, observations are less certain. A
/// track ends where its patch has grown or shrunk so much that it shows other things than at the beginning;
/// another begins there. Without extrinsics, points are predicted at constant image velocity, and matches are
/// in the camera's frame instead of the vehicle's.
class CameraTracker {
 public:
  /// Both arguments must outlive this object.
  CameraTracker(const RigCamera& camera, const FrameTrackerOptions& options);

  /// Tracks all points into the next image; predicts them for a vehicle that moved by
  /// `previous_from_current` and moves as `motion` says now. Appends a match per tracked point, with
  /// `camera_index` as camera; its rays begin at the camera. An empty image ends all tracks.
  void track(const Image& image, const RigidTransform& previous_from_current, const ImageMotion& motion,
             int camera_index, std::vector<RayMatch>* matches);

  /// Ends the tracks whose entry in `is_good` (one per match of the last track()) is false.
  void keep(const std::vector<bool>& is_good);

  /// Aligns all patches in the last image and extracts its features, for addKeyframe(). Cameras may do so at
  /// the same time.
  void readKeyframe(int32_t keyframe, const FeatureExtractor& extractor, KeyframeImage* out);

  /// Records all points at a keyframe that was read, and starts tracks at features that are not close to a
  /// tracked point.
  void addKeyframe(int32_t keyframe, int32_t camera_index, ReconstructionData* data);

 private:
  void alignWithAnchors(int32_t keyframe);
  /// Aligns a patch with its anchor. False, with the position unchanged, if it cannot be.
  bool align(LiveTrack* track) const;
  /// Aligns a patch with that of the last keyframe, which becomes its anchor. False, with the track
  /// unchanged, if it cannot be, or if that is its anchor.
  bool alignWithLastKeyframe(LiveTrack* track) const;
  bool isMasked(const Eigen::Vector2d& position_px) const;
  double exposedAt(const LiveTrack& track, const ImageMotion& motion) const;
  /// Rays of a track in two images. Of a vehicle at constant rates all lines see the same motion, each at its
  /// own time: what counts is by how much later or earlier the line of the second image was exposed. That is
  /// little and along the path, where it changes no epipolar plane, so only the turn is corrected. Where it
  /// begins along the path would tell the length of the motion, but that is the odometer's.
  RayMatch matchOf(const LiveTrack& previous, const ImageMotion& previous_motion, const LiveTrack& current,
                   const ImageMotion& motion) const;
  cv::Point2f predict(const LiveTrack& track, const RigidTransform& current_from_previous) const;

  const RigCamera& camera_;
  const FrameTrackerOptions& options_;
  const PatchTracker patch_tracker_;
  const cv::Mat mask_;
  const double spacing_px_;
  Image image_;
  ImageMotion motion_;  // at image_
  ImagePyramid pyramid_;
  std::vector<LiveTrack> tracks_;
  std::map<int32_t, Image> anchors_;  // key: keyframe; kept while a track refers to it
};

}  // namespace vcharge
