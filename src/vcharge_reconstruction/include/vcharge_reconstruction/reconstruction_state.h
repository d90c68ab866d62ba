#pragma once

#include <cstdint>
#include <memory>
#include <vector>

#include "vcharge_core/motion/trajectory.h"
#include "vcharge_features/vocabulary_tree.h"
#include "vcharge_reconstruction/reconstruction_data.h"
#include "vcharge_reconstruction/reconstruction_report.h"

namespace vcharge {

/// Pose of a processed frame relative to a keyframe.
struct FramePose {
  Timestamp stamp;
  int32_t keyframe = 0;  ///< index of the latest keyframe at that time
  RigidTransform keyframe_from_vehicle;
  MotionHypothesis motion = MotionHypothesis::kOdometry;  ///< model of the motion from the previous frame
};

/// A reconstruction and how it was made; the steps of a recipe change it one after the other.
struct ReconstructionState {
  ReconstructionData data;
  std::vector<FramePose> frames;
  std::vector<RigidTransform> keyframe_from_next;  ///< from the motions of the frames, before adjustment
  ReconstructionReport report;
  /// Vocabulary of the places among which loops were found; null before.
  std::shared_ptr<const VocabularyTree> vocabulary;
};

/// Poses of all frames in the map, based on the current poses of the keyframes.
Trajectory trajectoryOf(const ReconstructionState& state);

}  // namespace vcharge
