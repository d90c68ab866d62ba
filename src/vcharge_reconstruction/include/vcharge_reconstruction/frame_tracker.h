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
#include "vcharge_reconstruction/mapping_data.h"

namespace vcharge {

struct FrameTrackerOptions {
  int max_tracks_per_camera = 350;
  double min_spacing_px = 20.0;  ///< between a new track and those there are, at 1280 pixels of width
  /// A tracked point and a feature this close are the same.
  double max_association_px = 1.5;
  /// At keyframes a patch is aligned with that of its anchor, with its shape, so that it neither drifts away
  /// from step to step nor is pulled aside where the scene comes nearer. Where that moves it by more, or the
  /// patch looks different by now, this keyframe becomes its anchor.
  double max_alignment_px = 2.0;
  double tracking_sigma_px = 0.3;  ///< standard deviation of a tracked position
  PatchTrackerOptions patches = smallPatches();
  PatchAlignmentOptions alignment;

  static PatchTrackerOptions smallPatches();

  template <class Visitor>
  void visitFields(Visitor&& visit) {
    visit("max_tracks_per_camera", max_tracks_per_camera);
    visit("min_spacing_px", min_spacing_px);
    visit("max_association_px", max_association_px);
    visit("max_alignment_px", max_alignment_px);
    visit("tracking_sigma_px", tracking_sigma_px);
    visit("patches", patches);
    visit("alignment", alignment);
  }
  void validate() const;  ///< throws std::invalid_argument naming the field
};

/// A point that is followed from frame to frame in one camera.
struct LiveTrack {
  int32_t track = -1;  ///< index into MappingData::tracks
  cv::Point2f position_px;
  Eigen::Vector3d ray_in_camera;
  int32_t anchor_keyframe = 0;  ///< whose image shows the patch that is followed
  cv::Point2f anchor_px;
  /// Of the patch at the last keyframe, against the anchor's.
  Eigen::Matrix2d shape = Eigen::Matrix2d::Identity();
  cv::Point2f last_step_px = {0.0F, 0.0F};  ///< from the image before
};

/// Follows the points of one camera through its images. Without extrinsics points are expected to go on as
/// they went, and matches are in the camera's frame instead of the vehicle's.
class CameraTracker {
 public:
  /// Both must outlive this object.
  CameraTracker(const RigCamera& camera, const FrameTrackerOptions& options);

  /// Follows all points into the next image, beginning the search where they are expected when the vehicle
  /// moved by `previous_from_current`. Writes a match per point that was found; `camera_index` labels them.
  /// An empty image loses all points.
  void track(const Image& image, const RigidTransform& previous_from_current, int camera_index,
             std::vector<RayMatch>* matches);

  /// Points whose match (of the last call of track()) is false are dropped.
  void keep(const std::vector<bool>& is_good);

  /// Records all points at a keyframe and begins tracks at features that are not close to one.
  void addKeyframe(int32_t keyframe, int32_t camera_index, const FeatureExtractor& extractor,
                   MappingData* data);

  size_t numTracks() const { return tracks_.size(); }

 private:
  void alignWithAnchors(int32_t keyframe);
  bool isMasked(const Eigen::Vector2d& position_px) const;
  RigidTransform vehicleFromCamera() const;
  cv::Point2f predict(const LiveTrack& track, const RigidTransform& current_from_previous) const;

  const RigCamera& camera_;
  const FrameTrackerOptions& options_;
  const PatchTracker patch_tracker_;
  const cv::Mat mask_;
  const double spacing_px_;
  Image image_;
  ImagePyramid pyramid_;
  std::vector<LiveTrack> tracks_;
  std::map<int32_t, Image> anchors_;  // by keyframe, while a track has it
};

}  // namespace vcharge
