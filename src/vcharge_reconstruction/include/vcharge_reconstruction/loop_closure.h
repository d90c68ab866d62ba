#pragma once

#include <cstdint>
#include <functional>
#include <memory>
#include <string>
#include <vector>

#include <Eigen/Core>

#include "vcharge_core/base/options.h"
#include "vcharge_features/vocabulary_tree.h"
#include "vcharge_reconstruction/reconstruction_data.h"

namespace vcharge {

struct LoopClosureOptions {
  VCHARGE_BEGIN_OPTIONS(LoopClosureOptions);
  VCHARGE_OPTION(double, min_travel_m, 10.0, notNegative(), "Travel between two visits that make a loop.");
  VCHARGE_OPTION(int, max_candidates, 5, atLeast(1), "Loop candidates verified per keyframe.");
  VCHARGE_OPTION(int, min_inliers, 20, atLeast(6), "Least inliers of a loop edge.");
  VCHARGE_OPTION(double, min_inlier_ratio, 0.15, between(0.0, 1.0), "Least inlier ratio of a loop edge.");
  VCHARGE_OPTION(double, max_sigma_m, 0.15, positive(), "Largest deviation of a loop edge's translation.");
  VCHARGE_END_OPTIONS();
};

/// Reason of a loop edge that the others predict too little to tell whether it is true.
constexpr const char* kUndecidedLoop = "neither confirmed nor contradicted";

/// Relative pose of two keyframes at a place that the vehicle visited twice.
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

/// Trains a vocabulary from the drive itself. InputError if the drive has no features.
std::shared_ptr<const VocabularyTree> trainVocabulary(const ReconstructionData& data);

/// Finds loop candidates for every keyframe by the features of all cameras (paper, section Loop-Closure
/// Detection) from `first_of_new` on, and verifies each with verifyLoop(). Data parallel, deterministic.
std::vector<LoopEdge> findLoops(const LoopClosureOptions& options,
                                const std::shared_ptr<const VocabularyTree>& vocabulary,
                                const ReconstructionData& data, const LoopProgress& progress,
                                int32_t first_of_new = 0);

/// The same between earlier sessions and new ones, whose keyframes begin with `first_of_new`.
std::vector<LoopEdge> findLoopsBetween(const LoopClosureOptions& options,
                                       const std::shared_ptr<const VocabularyTree>& vocabulary,
                                       const ReconstructionData& data, int32_t first_of_new,
                                       const LoopProgress& progress);

/// Verifies one pair of keyframes on the pairs of cameras (of `first`, of `second`) with similar images: with
/// the planar 3-point solver, or the 4-point solver with known vertical. The metric pose follows from the
/// rays of one rig and the landmarks of the other (generalized P3P). The result's reason is empty if it is
/// verified.
LoopEdge verifyLoop(const LoopClosureOptions& options, const ReconstructionData& data, int32_t first,
                    int32_t second, const std::vector<std::pair<int, int>>& camera_pairs);

/// Pose graph over all keyframes, which rejects false edges, alone or in groups (optimizeRobustly()): moves
/// the keyframes, and sets which verified edges were accepted. Keyframes before `first_of_new` are adjusted,
/// and stay nearly where they are relative to each other.
void closeLoops(std::vector<LoopEdge>* edges, ReconstructionData* data, int32_t first_of_new = 0);

/// Rejects accepted edges that contradict the adjusted keyframes, which depend on thousands of landmarks.
void checkLoops(const ReconstructionData& data, std::vector<LoopEdge>* edges);

}  // namespace vcharge
