#pragma once

#include <cstdint>
#include <functional>
#include <memory>
#include <string>
#include <vector>

#include <Eigen/Core>

#include "vcharge_core/base/options.h"
#include "vcharge_features/descriptor_matching.h"
#include "vcharge_features/vocabulary_tree.h"
#include "vcharge_geometry/pose_graph/robust_pose_graph.h"
#include "vcharge_geometry/robust/robust_options.h"
#include "vcharge_reconstruction/mapping_data.h"

namespace vcharge {

struct LoopClosureOptions {
  VocabularyTreeOptions vocabulary = smallVocabulary();
  double training_spacing_m = 2.5;  ///< between keyframes that the vocabulary is trained from
  double min_travel_m = 10.0;       ///< between two passes of a place
  int max_candidates = 5;           ///< that look most alike, per keyframe
  MatchOptions matching;
  RobustOptions robust = defaultRobust();  ///< of the planar motion, and of the pose among landmarks
  int min_inliers = 20;
  double min_inlier_ratio = 0.15;
  double max_sigma_m = 0.15;            ///< a less certain edge is rejected
  double max_disagreement_rad = 0.035;  ///< between the planar motion and the pose among landmarks
  /// Between an edge and the adjusted keyframes; one that is further off was wrong after all.
  double max_final_error_m = 0.2;
  double max_final_error_rad = 0.03;
  // Pose graph: what the motion between consecutive keyframes and a loop edge are good for, besides their own
  // covariance.
  double step_sigma_m = 0.01;
  double step_sigma_rad = 0.001;
  double loop_sigma_m = 0.03;
  double loop_sigma_rad = 0.003;

  static VocabularyTreeOptions smallVocabulary();
  static RobustOptions defaultRobust();

  template <class Visitor>
  void visitFields(Visitor&& visit) {
    visit("training_spacing_m", training_spacing_m);
    visit("min_travel_m", min_travel_m);
    visit("max_candidates", max_candidates);
    visit("matching", matching);
    visit("robust", robust);
    visit("min_inliers", min_inliers);
    visit("min_inlier_ratio", min_inlier_ratio);
    visit("max_sigma_m", max_sigma_m);
    visit("max_disagreement_rad", max_disagreement_rad);
    visit("max_final_error_m", max_final_error_m);
    visit("max_final_error_rad", max_final_error_rad);
    visit("step_sigma_m", step_sigma_m);
    visit("step_sigma_rad", step_sigma_rad);
    visit("loop_sigma_m", loop_sigma_m);
    visit("loop_sigma_rad", loop_sigma_rad);
    visit("vocabulary", vocabulary);
  }
  void validate() const;  ///< throws std::invalid_argument naming the field
};

/// A place that was passed twice.
struct LoopEdge {
  int32_t first = 0;  ///< the earlier keyframe
  int32_t second = 0;
  RigidTransform first_from_second;
  Eigen::Matrix<double, 6, 6> covariance =
      Eigen::Matrix<double, 6, 6>::Zero();  ///< [dt, dphi], first's frame
  int num_inliers = 0;
  bool is_planar = true;  ///< verified by the 3-point solver; else by the 4-point one
  bool accepted = false;
  std::string reason;  ///< why it was rejected
};

using LoopProgress = std::function<void(double)>;

/// Trained from the drive itself. InputError where it holds no features.
std::shared_ptr<const VocabularyTree> trainVocabulary(const LoopClosureOptions& options,
                                                      const MappingData& data);

/// Candidates of every keyframe by what the whole rig sees (paper, section Loop-Closure Detection), verified
/// by the planar 3-point solver, or the 4-point one with known vertical; their metric pose is that of the
/// later rig among the landmarks of the earlier one (generalized P3P). Data parallel, deterministic.
std::vector<LoopEdge> findLoops(const LoopClosureOptions& options,
                                const std::shared_ptr<const VocabularyTree>& vocabulary,
                                const MappingData& data, const LoopProgress& progress);

/// Verifies one pair of keyframes by the pairs of cameras (of `first`, of `second`) that look alike. The
/// result's reason is empty where it is right.
LoopEdge verifyLoop(const LoopClosureOptions& options, const MappingData& data, int32_t first, int32_t second,
                    const std::vector<std::pair<int, int>>& camera_pairs);

/// Robust pose graph over all keyframes (Lee et al., IROS 2013): moves the keyframes, and says of every
/// verified edge whether it was accepted.
void closeLoops(const LoopClosureOptions& options, std::vector<LoopEdge>* edges, MappingData* data);

/// Rejects accepted edges that the adjusted keyframes contradict: thousands of landmarks outvote a few.
void checkLoops(const LoopClosureOptions& options, const MappingData& data, std::vector<LoopEdge>* edges);

}  // namespace vcharge
