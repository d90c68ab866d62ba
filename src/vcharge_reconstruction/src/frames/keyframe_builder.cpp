#include "vcharge_reconstruction/keyframe_builder.h"

#include <utility>

namespace vcharge {

FrameAssemblerOptions KeyframeOptions::assemblerOptions() const {
  FrameAssemblerOptions options;
  options.waitForEverything();
  options.max_speed_m_per_s = max_speed_m_per_s;
  return options;
}

bool KeyframeBuilder::isDue(const RigidTransform& keyframe_from_vehicle) const {
  return state_->data.keyframes.empty() ||
         keyframe_from_vehicle.translation().norm() >= options_.keyframe_distance_m ||
         angleOfRotation(keyframe_from_vehicle.rotation()) >= options_.keyframe_turn_rad;
}

int32_t KeyframeBuilder::addKeyframe(Keyframe keyframe, const RigidTransform& keyframe_from_vehicle,
                                     MotionHypothesis motion) {
  std::vector<Keyframe>& keyframes = state_->data.keyframes;
  const auto index = static_cast<int32_t>(keyframes.size());
  if (index > 0) {
    state_->keyframe_from_next.push_back(keyframe_from_vehicle);
  }
  keyframe.images.resize(state_->data.rig->cameras.size());
  state_->frames.push_back({keyframe.stamp, index, RigidTransform(), motion});
  keyframes.push_back(std::move(keyframe));
  return index;
}

void KeyframeBuilder::addFrame(Timestamp stamp, const RigidTransform& keyframe_from_vehicle,
                               MotionHypothesis motion) {
  const auto last = static_cast<int32_t>(state_->data.keyframes.size()) - 1;
  state_->frames.push_back({stamp, last, keyframe_from_vehicle, motion});
}

}  // namespace vcharge
