#pragma once

#include <cstdint>
#include <functional>
#include <memory>
#include <optional>
#include <vector>

#include "vcharge_core/frames/frame_assembler.h"
#include "vcharge_features/feature_extractor.h"
#include "vcharge_reconstruction/ego_motion.h"
#include "vcharge_reconstruction/frame_tracker.h"
#include "vcharge_reconstruction/keyframe_builder.h"
#include "vcharge_reconstruction/reconstruction_options.h"
#include "vcharge_reconstruction/reconstruction_state.h"

namespace vcharge {

/// Frames -> tracks -> keyframes: tracks points through the images of all cameras, estimates the motion from
/// frame to frame, and appends frames, keyframes and tracks to a reconstruction. Data parallel over cameras.
class FrameFollower : public DriveConsumer {
 public:
  using KeyframeCallback = std::function<void(int32_t keyframe, const std::vector<Image>& images)>;

  /// `state` has the rig and must outlive this object. Without `ego_motion` the vehicle moves as counted by
  /// the odometer, and the rig needs no extrinsics. `on_keyframe` may be empty.
  FrameFollower(const ReconstructionOptions& options, const std::optional<EgoMotionOptions>& ego_motion,
                ReconstructionState* state, KeyframeCallback on_keyframe);
  ~FrameFollower() override;

  void addImage(size_t camera_index, Timestamp stamp, const Image& image) override;
  void addOdometry(const VehicleOdometry& odometry) override;
  /// Processes the frames that still wait for images or odometry.
  void flush();

 private:
  using MatchesByCamera = std::vector<std::vector<RayMatch>>;

  void processFrame(const ImageFrame& frame);
  MatchesByCamera track(const std::vector<Image>& images, const RigidTransform& odometry_motion,
                        const FrameMotion& motion);
  /// Estimates the motion from the previous frame; ends the tracks that contradict it.
  EgoMotion estimateMotion(const MatchesByCamera& matches, const RigidTransform& odometry_motion);
  void addKeyframe(const ImageFrame& frame, const RigidTransform& keyframe_from_vehicle,
                   MotionHypothesis motion);

  const ReconstructionOptions options_;
  const std::optional<EgoMotionOptions> ego_motion_;
  const std::shared_ptr<const CameraRig> rig_;
  ReconstructionState* const state_;
  const KeyframeCallback on_keyframe_;
  const std::unique_ptr<FeatureExtractor> extractor_;
  std::vector<CameraTracker> trackers_;  // one per camera
  KeyframeBuilder keyframes_;
  FrameAssembler<Image> assembler_;
  RigidTransform previous_odom_from_vehicle_, map_from_vehicle_;
  double travelled_m_ = 0.0;
};

}  // namespace vcharge
