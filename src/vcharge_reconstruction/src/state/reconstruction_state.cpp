#include "vcharge_reconstruction/reconstruction_state.h"

namespace vcharge {

Trajectory trajectoryOf(const ReconstructionState& state) {
  Trajectory trajectory;
  for (const FramePose& frame : state.frames) {
    const Keyframe& keyframe = state.data.keyframes[frame.keyframe];
    RigidTransform keyframe_from_vehicle = frame.keyframe_from_vehicle;
    if (static_cast<size_t>(frame.keyframe) + 1 < state.data.keyframes.size()) {
      // The change by adjustment between two keyframes is distributed evenly over time.
      const Keyframe& next = state.data.keyframes[frame.keyframe + 1];
      const RigidTransform adjusted = keyframe.map_from_vehicle.inverse() * next.map_from_vehicle;
      const double fraction =
          toSeconds(frame.stamp - keyframe.stamp) / toSeconds(next.stamp - keyframe.stamp);
      const RigidTransform change = adjusted * state.keyframe_from_next[frame.keyframe].inverse();
      keyframe_from_vehicle = interpolate(RigidTransform(), change, fraction) * keyframe_from_vehicle;
    }
    trajectory.push_back({frame.stamp, keyframe.map_from_vehicle * keyframe_from_vehicle});
  }
  return trajectory;
}

}  // namespace vcharge
