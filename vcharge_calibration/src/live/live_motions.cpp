#include "live/live_motions.h"

#include <algorithm>

#include "initialization/camera_motion.h"
#include "vcharge_reconstruction/live_view.h"

namespace vcharge {

void updateCoach(const ReconstructionState& state, CalibrationCoach* coach) {
  const auto begin = std::max<int32_t>(0, static_cast<int32_t>(coach->numKeyframes()) - 1);
  for (size_t k = coach->numKeyframes(); k < state.data.keyframes.size(); ++k) {
    const Keyframe& keyframe = state.data.keyframes[k];
    coach->addKeyframe(keyframe.odom_from_vehicle, keyframe.travelled_m);
  }
  const ReconstructionData part = lastPart(state.data, begin);
  for (size_t camera = 0; camera < state.data.rig->cameras.size(); ++camera) {
    for (MotionPair motion : estimateCameraMotions(part, static_cast<int32_t>(camera))) {
      motion.keyframe += begin;
      coach->addMotion(camera, motion);
    }
  }
}

}  // namespace vcharge
