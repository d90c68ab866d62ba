#pragma once

#include <array>
#include <cstdint>
#include <map>
#include <string>
#include <vector>

#include "vcharge_core/frames/frame_assembler.h"
#include "vcharge_reconstruction/ego_motion.h"
#include "vcharge_reconstruction/loop_closure.h"

namespace vcharge {

/// Consecutive frames that were not used, or not completely, for one reason.
struct SkippedFrames {
  std::string reason;
  Timestamp first, last;
  int64_t num_frames = 0;
  int64_t last_frame = 0;  ///< number of the frame with stamp `last`, counted from 1
};

/// Counts, errors and times of a reconstruction.
struct ReconstructionReport {
  FrameCounters counters;
  int64_t num_standing_frames = 0;
  std::vector<SkippedFrames> skipped;    ///< in the order of the drive
  std::array<int64_t, 4> num_motions{};  ///< index: MotionHypothesis
  int64_t num_landmarks = 0;
  int64_t num_observations = 0;
  double rms_px = 0.0;
  std::vector<LoopEdge> loop_edges;
  std::vector<std::string> stages = {"following"};  ///< in the order in which they ran
  std::map<std::string, double> stage_s;            ///< wall time by stage

  /// Takes the counters of the assembler that hands out this frame, and notes the images and odometry that
  /// the frame lacks.
  void noteFrame(const ImageFrame& frame, const CameraRig& rig, const FrameCounters& frame_counters);
  /// Notes that the newest frame was not used, or not completely.
  void noteSkipped(Timestamp stamp, const std::string& reason);
};

}  // namespace vcharge
