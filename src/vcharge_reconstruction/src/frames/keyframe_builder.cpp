#include "vcharge_reconstruction/keyframe_builder.h"

#include <algorithm>
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

void KeyframeBuilder::correct(const std::vector<CorrectedPose>& corrections) {
  for (const CorrectedPose& corrected : corrections) {
    const auto frame = std::find_if(state_->frames.rbegin(), state_->frames.rend(),
                                    [&](const FramePose& each) { return each.stamp <= corrected.stamp; });
    if (frame == state_->frames.rend() || frame->stamp != corrected.stamp) {
      continue;  // a frame at standstill was left out
    }
    const bool is_counted = frame->motion == MotionHypothesis::kOdometry;
    const auto index = static_cast<size_t>(frame->keyframe);
    Keyframe& keyframe = state_->data.keyframes[index];
    if (keyframe.stamp == corrected.stamp) {
      keyframe.odom_from_vehicle = corrected.bridged_from_vehicle;
      if (is_counted && index > 0) {
        keyframe.map_from_vehicle = keyframe.map_from_vehicle * corrected.old_vehicle_from_vehicle;
        RigidTransform& from_previous = state_->keyframe_from_next[index - 1];
        from_previous = from_previous * corrected.old_vehicle_from_vehicle;
      }
    } else if (is_counted) {
      frame->keyframe_from_vehicle = frame->keyframe_from_vehicle * corrected.old_vehicle_from_vehicle;
    }
  }
}

}  // namespace vcharge
