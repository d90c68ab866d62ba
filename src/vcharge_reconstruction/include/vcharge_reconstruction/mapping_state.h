#pragma once

#include <cstdint>
#include <memory>
#include <vector>

#include "vcharge_core/motion/trajectory.h"
#include "vcharge_features/vocabulary_tree.h"
#include "vcharge_reconstruction/mapping_data.h"
#include "vcharge_reconstruction/sparse_mapper_report.h"

namespace vcharge {

/// A frame that was followed.
struct FramePose {
  Timestamp stamp;
  int32_t keyframe = 0;  ///< the last one
  RigidTransform keyframe_from_vehicle;
  MotionHypothesis motion = MotionHypothesis::kOdometry;  ///< from the frame before
};

/// All that making a map needs after a stage: what a checkpoint keeps.
struct MappingState {
  MappingData data;
  std::vector<FramePose> frames;
  std::vector<RigidTransform> keyframe_from_next;  ///< as the motions between them add up
  SparseMapperReport report;
  std::shared_ptr<const VocabularyTree> vocabulary;  ///< null before its stage
  int32_t num_finished_stages = 0;                   ///< of backEndStages()
};

/// Poses of all frames that were followed, in the map, by those of the keyframes as they are now.
Trajectory trajectoryOf(const MappingState& state);

}  // namespace vcharge
