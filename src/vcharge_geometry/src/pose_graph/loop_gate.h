#pragma once

#include <cstddef>
#include <map>
#include <optional>
#include <vector>

#include "pose_graph/loop_groups.h"
#include "pose_graph/uncertain_graph.h"
#include "vcharge_geometry/pose_graph/pose_graph.h"

namespace vcharge {

enum class LoopVerdict {
  kAccepted,
  kContradicted,  ///< odometry and accepted loops predict another pose
  kUndecided,     ///< they predict too little to tell whether the loops are true
};

/// Loops of one place that agree with each other.
struct GatedGroup {
  std::vector<size_t> loops;  ///< indices of the graph's edges
  LoopVerdict verdict = LoopVerdict::kUndecided;
  bool is_predicted = true;  ///< well enough to be decided alone
};

/// Decides which loop edges are true.
///
/// Loops whose ends are a few steps apart and that agree with each other are a group, which has one vote: two
/// places that look alike give many loops that agree. A group is compared with the relative pose along the
/// least uncertain path of odometry and loops accepted before, the most certain predictions first. It is
/// accepted if agreement by chance is improbable: by its likelihood ratio over the spread of all poses, alone
/// or together with groups of other places that it brings to agree. So local loops confirm wide ones, and
/// each is tested with as narrow a prediction as there can be (after Mangelson et al., "Pairwise consistent
/// measurement set maximization", ICRA 2018, and Latif et al., "Robust loop closing over time", IJRR 2013).
class LoopGate {
 public:
  /// `odometry`, `loops`: indices of graph.edges. `noise_scale` multiplies the covariances of all edges;
  /// absent if neighbouring loops shall tell it. InputError unless the odometry connects all nodes.
  LoopGate(const PoseGraph& graph, const std::vector<size_t>& odometry, const std::vector<size_t>& loops,
           std::optional<double> noise_scale);

  void decide();
  /// Hears groups again that are not accepted, with the poses of an optimum that did not need them. Returns
  /// whether any was accepted.
  bool hearAgain(const std::map<int64_t, RigidTransform>& map_from_node);

  /// Whether each loop, by its edge, is more likely true than false at an optimum.
  std::map<size_t, bool> agreeing(const std::map<int64_t, RigidTransform>& map_from_node) const;

  std::vector<GatedGroup> groups() const;
  /// All nodes, placed along the least uncertain paths of odometry and accepted loops.
  std::map<int64_t, RigidTransform> placed() const;
  double noiseScale() const { return noise_scale_; }

 private:
  struct Test {
    double weight = 0.0;        // of the path
    double log_evidence = 0.0;  // likelihood ratio of "true" over "false"
    bool is_sharp = false;      // the prediction's covariance can be trusted
  };
  /// Groups that agree if the first is true, and their evidence over what is needed.
  struct Alliance {
    double log_evidence = 0.0;
    std::vector<size_t> groups;
  };
  using Path = UncertainGraph::Path;

  void measureSpread(const std::vector<RelativePose>& steps);
  /// Covariance of the error of a false loop between these nodes.
  Matrix6d spreadOf(const OrderedLoop& loop) const;
  std::vector<size_t> membersThatStandFor(const GatedGroup& group) const;
  std::optional<Test> test(const GatedGroup& group, double max_weight) const;
  std::vector<std::optional<Test>> testAll(const std::vector<size_t>& groups, double max_weight) const;
  Test compare(const OrderedLoop& loop, const Path& predicted) const;
  bool confirms(const Test& test, const GatedGroup& group) const;
  double minLogEvidence(const GatedGroup& group) const;
  /// Groups that aren't accepted over those that are: where nearly all are true, another hardly is false.
  double priorOddsOfFalse() const;
  std::vector<size_t> undecidedGroups() const;
  bool isOfOtherPlace(const GatedGroup& a, const GatedGroup& b) const;
  bool decideAlone(double max_weight);
  bool decideTogether();
  Alliance supportersOf(size_t hypothesis, const std::vector<size_t>& undecided,
                        const std::vector<Test>& alone) const;
  void accept(GatedGroup* group);

  bool planar_;
  std::vector<size_t> edges_;  // of the loops in the graph
  std::vector<int64_t> nodes_;
  std::vector<RigidTransform> map_from_node_;  // along the odometry
  std::vector<OrderedLoop> loops_;
  std::vector<GatedGroup> groups_;  // with indices of loops_
  double noise_scale_ = 1.0;
  Eigen::Matrix3d position_spread_ = Eigen::Matrix3d::Zero();  // in the map
  Eigen::Vector3d rotation_spread_ = Eigen::Vector3d::Zero();  // in the node's frame
  double step_square_m2_ = 0.0;                                // mean over the steps
  Eigen::Vector3d step_square_rad2_ = Eigen::Vector3d::Zero();
  Vector6d loop_square_ = Vector6d::Zero();  // mean over the measured loops
  double step_weight_ = 0.0;
  double odometry_weight_ = 0.0;
  std::optional<UncertainGraph> known_;
};

}  // namespace vcharge
