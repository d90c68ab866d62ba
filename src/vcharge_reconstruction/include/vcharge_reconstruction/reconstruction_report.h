#pragma once

#include <array>
#include <cstdint>
#include <map>
#include <string>
#include <vector>

#include "vcharge_reconstruction/ego_motion.h"
#include "vcharge_reconstruction/loop_closure.h"

namespace vcharge {

/// Consecutive frames that were not used, or not completely, for one reason.
struct SkippedFrames {
  std::string reason;
  Timestamp first, last;
  int64_t num_frames = 0;
};

/// Counts, errors and times of a reconstruction.
struct ReconstructionReport {
  int64_t num_frames = 0;             ///< frames (sets of images with one stamp)
  int64_t num_incomplete_frames = 0;  ///< frames that lack an image of a camera
  int64_t num_frames_without_odometry = 0;
  int64_t num_standing_frames = 0;
  int64_t num_odometry_resets = 0;
  int64_t num_late_images = 0;              ///< images that arrived after their frame was processed
  std::vector<int64_t> num_missing_images;  ///< one per camera
  std::vector<SkippedFrames> skipped;       ///< in the order of the drive
  std::array<int64_t, 4> num_motions{};     ///< index: MotionHypothesis
  int64_t num_landmarks = 0;
  int64_t num_observations = 0;
  double rms_px = 0.0;
  std::vector<LoopEdge> loop_edges;
  std::vector<std::string> stages = {"following"};  ///< in the order in which they ran
  std::map<std::string, double> stage_s;            ///< wall time by stage
};

}  // namespace vcharge
