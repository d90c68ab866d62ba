#pragma once

#include <cstdint>

#include "vcharge_core/base/options.h"
#include "vcharge_core/frames/frame_assembler.h"
#include "vcharge_reconstruction/reconstruction_state.h"

namespace vcharge {

/// Options of the frames of a drive and the selection of keyframes.
struct KeyframeOptions {
  VCHARGE_BEGIN_OPTIONS(KeyframeOptions);
  VCHARGE_OPTION(double, keyframe_distance_m, 0.5, positive(), "Distance between keyframes.");
  VCHARGE_OPTION(double, keyframe_turn_rad, 0.1, positive(), "Turn between keyframes.");
  VCHARGE_OPTION(double, max_speed_m_per_s, 25.0, positive(), "Speed above which odometry was reset.");
  VCHARGE_END_OPTIONS();

  /// Options of the assembler of the frames, which waits for all images and odometry.
  FrameAssemblerOptions assemblerOptions() const;
};

/// Appends the frames of a drive to a reconstruction and selects its keyframes.
class KeyframeBuilder {
 public:
  /// `state` must outlive this object.
  KeyframeBuilder(const KeyframeOptions& options, ReconstructionState* state)
      : options_(options), state_(state) {}

  /// Whether a frame that moved this far since the last keyframe becomes one; the first frame always does.
  bool isDue(const RigidTransform& keyframe_from_vehicle) const;

  /// Appends a keyframe without images; `keyframe_from_vehicle` is its pose relative to the previous one.
  /// Returns its index.
  int32_t addKeyframe(Keyframe keyframe, const RigidTransform& keyframe_from_vehicle,
                      MotionHypothesis motion);

  /// Appends a frame between keyframes.
  void addFrame(Timestamp stamp, const RigidTransform& keyframe_from_vehicle, MotionHypothesis motion);

  /// Corrects the odometry of earlier frames, and their poses where these follow from it.
  void correct(const std::vector<CorrectedPose>& corrections);

 private:
  const KeyframeOptions options_;
  ReconstructionState* const state_;
};

}  // namespace vcharge
