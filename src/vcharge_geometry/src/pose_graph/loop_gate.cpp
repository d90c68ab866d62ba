#include "pose_graph/loop_gate.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <map>
#include <numeric>
#include <optional>

#include <tbb/parallel_for.h>

#include "pose_graph/loop_groups.h"
#include "pose_graph/uncertain_graph.h"
#include "vcharge_core/base/error.h"
#include "vcharge_core/base/quantile.h"

namespace vcharge {
namespace {

/// Logarithm of the number of ways to choose some of many, from above: some of many agree by chance.
double logChoices(size_t num_all, size_t num_chosen) {
  const auto part = [num_all](size_t num) {
    return num == 0
               ? 0.0
               : static_cast<double>(num) * std::log(static_cast<double>(num_all) / static_cast<double>(num));
  };
  return part(num_chosen) + part(num_all - num_chosen);
}

/// Expected number of false groups that are accepted by chance, and of those when they are heard again.
constexpr double kChance = 1e-3;
constexpr double kChanceAgain = 0.05;
/// A single loop of an accepted group is kept if it is so many times as likely true as false.
constexpr double kKeptOdds = 10.0;
/// A prediction with a larger deviation of its rotation says nothing: the covariance is that of small errors.
constexpr double kMaxRotationSigma_rad = 0.3;
/// Groups whose ends are as many steps apart are of different places.
constexpr size_t kPlaceSteps = 20;
/// How many steps long, in terms of uncertainty, a path may be along which groups support each other.
constexpr double kSupportSteps = 200.0;
constexpr size_t kMaxHypotheses = 256;
constexpr double kInfinity = std::numeric_limits<double>::infinity();

/// What an edge measures, from its lower to its higher node.
RelativePose upward(const PoseGraphEdge& edge, bool planar) {
  const RelativePose measured = measuredBy(edge, planar);
  return edge.first < edge.second ? measured : inverseOf(measured);
}

}  // namespace

LoopGate::LoopGate(const PoseGraph& graph, const std::vector<size_t>& odometry,
                   const std::vector<size_t>& loops, std::optional<double> noise_scale)
    : planar_(graph.planar), edges_(loops) {
  std::map<int64_t, size_t> index_of;
  for (const auto& [node, pose] : graph.map_from_node) {
    index_of[node] = nodes_.size();
    nodes_.push_back(node);
  }
  std::vector<std::optional<RelativePose>> found(nodes_.size());
  for (const size_t i : odometry) {
    const PoseGraphEdge& edge = graph.edges[i];
    found[index_of.at(std::min(edge.first, edge.second))] = upward(edge, planar_);
  }
  std::vector<RelativePose> steps;
  map_from_node_.resize(1);
  std::vector<double> lengths_m;
  for (size_t i = 0; i + 1 < nodes_.size(); ++i) {
    if (!found[i]) {
      throw InputError("pose graph: edges between consecutive nodes do not connect all nodes");
    }
    steps.push_back(*found[i]);
    map_from_node_.push_back(map_from_node_.back() * steps.back().first_from_second);
    lengths_m.push_back(steps.back().first_from_second.translation().norm());
  }
  for (const size_t i : loops) {
    const PoseGraphEdge& edge = graph.edges[i];
    loops_.push_back({index_of.at(std::min(edge.first, edge.second)),
                      index_of.at(std::max(edge.first, edge.second)), upward(edge, planar_)});
  }
  LoopGroups grouped = groupLoops(loops_, steps, planar_, noise_scale);
  noise_scale_ = grouped.noise_scale;
  for (std::vector<size_t>& group : grouped.groups) {
    groups_.push_back({std::move(group)});
  }
  for (OrderedLoop& loop : loops_) {
    loop.measured.covariance *= noise_scale_;
  }
  constexpr double kLeverSteps = 10.0;
  known_.emplace(nodes_.size(), kLeverSteps * quantile(lengths_m, 0.5));
  std::vector<double> weights;
  for (size_t i = 0; i < steps.size(); ++i) {
    steps[i].covariance *= noise_scale_;
    known_->addEdge(i, i + 1, steps[i]);
    weights.push_back(known_->weightOf(steps[i].covariance));
    odometry_weight_ += weights.back();
  }
  step_weight_ = quantile(weights, 0.5);
  measureSpread(steps);
}

void LoopGate::measureSpread(const std::vector<RelativePose>& steps) {
  const auto num_nodes = static_cast<double>(map_from_node_.size());
  Eigen::Vector3d mean = Eigen::Vector3d::Zero();
  Eigen::Vector3d up = Eigen::Vector3d::Zero();
  for (const RigidTransform& pose : map_from_node_) {
    mean += pose.translation() / num_nodes;
    up += pose.rotation() * Eigen::Vector3d::UnitZ() / num_nodes;
  }
  for (const RigidTransform& pose : map_from_node_) {
    const Eigen::Vector3d offset = pose.translation() - mean;
    position_spread_ += 2.0 * offset * offset.transpose() / num_nodes;
  }
  // Headings are uniform; the mean of unit vectors is as much shorter than 1 as they are tilted.
  constexpr double kHeadingVariance = M_PI * M_PI / 3.0;
  const double tilt_variance = std::min(kHeadingVariance, 2.0 * (1.0 - up.norm()));
  rotation_spread_ << tilt_variance, tilt_variance, kHeadingVariance;
  for (const RelativePose& step : steps) {
    const auto num_steps = static_cast<double>(steps.size());
    step_square_m2_ += step.first_from_second.translation().squaredNorm() / num_steps;
    step_square_rad2_ += vectorFromRotation(step.first_from_second.rotation()).cwiseAbs2() / num_steps;
  }
  for (const OrderedLoop& loop : loops_) {
    const auto num_loops = static_cast<double>(loops_.size());
    loop_square_.head<3>() += loop.measured.first_from_second.translation().cwiseAbs2() / num_loops;
    loop_square_.tail<3>() +=
        vectorFromRotation(loop.measured.first_from_second.rotation()).cwiseAbs2() / num_loops;
  }
}

Matrix6d LoopGate::spreadOf(const OrderedLoop& loop) const {
  // Nodes a few steps apart are not as far from each other as others.
  const auto num_steps = static_cast<double>(loop.second - loop.first);
  const double part = std::min(1.0, num_steps * num_steps * step_square_m2_ / position_spread_.trace());
  const Eigen::Matrix3d node_from_map = map_from_node_[loop.second].rotationMatrix().transpose();
  Matrix6d spread = Matrix6d::Zero();
  spread.topLeftCorner<3, 3>() = part * node_from_map * position_spread_ * node_from_map.transpose();
  spread.diagonal().tail<3>() = rotation_spread_.cwiseMin(num_steps * num_steps * step_square_rad2_);
  spread.diagonal() += loop_square_;
  return spread;
}

std::vector<size_t> LoopGate::membersThatStandFor(const GatedGroup& group) const {
  std::vector<size_t> members = {group.loops.front(), group.loops[group.loops.size() / 2],
                                 group.loops.back()};
  members.erase(std::unique(members.begin(), members.end()), members.end());
  return members;
}

std::optional<LoopGate::Test> LoopGate::test(const GatedGroup& group, double max_weight) const {
  std::optional<Path> best;
  const OrderedLoop* tested = nullptr;
  for (const size_t i : membersThatStandFor(group)) {
    auto path = known_->path(loops_[i].first, loops_[i].second, best ? best->weight : max_weight);
    if (path && (!best || path->weight < best->weight)) {
      best = std::move(path);
      tested = &loops_[i];
    }
  }
  return best ? std::make_optional(compare(*tested, *best)) : std::nullopt;
}

LoopGate::Test LoopGate::compare(const OrderedLoop& loop, const Path& predicted) const {
  const Disagreement error(predicted.first_from_second, loop.measured, planar_);
  const double variance = predicted.first_from_second.covariance.diagonal().tail<3>().maxCoeff();
  return {predicted.weight, error.logEvidence(spreadOf(loop)),
          variance < kMaxRotationSigma_rad * kMaxRotationSigma_rad};
}

std::vector<size_t> LoopGate::undecidedGroups() const {
  std::vector<size_t> undecided;
  for (size_t i = 0; i < groups_.size(); ++i) {
    if (groups_[i].verdict == LoopVerdict::kUndecided) {
      undecided.push_back(i);
    }
  }
  return undecided;
}

bool LoopGate::confirms(const Test& test, const GatedGroup& group) const {
  return test.is_sharp && test.log_evidence > minLogEvidence(group);
}

double LoopGate::minLogEvidence(const GatedGroup& group) const {
  const auto num_rivals = std::count_if(groups_.begin(), groups_.end(), [&](const GatedGroup& other) {
    return other.verdict == LoopVerdict::kUndecided && other.is_predicted &&
           other.loops.size() >= group.loops.size();
  });
  return std::log(std::max(1.0, static_cast<double>(num_rivals)) / kChance);
}

bool LoopGate::decideAlone(double max_weight) {
  const size_t num_known = known_->numEdges();
  std::vector<std::pair<size_t, Test>> order;
  const std::vector<size_t> undecided = undecidedGroups();
  const std::vector<std::optional<Test>> tests = testAll(undecided, max_weight);
  for (size_t k = 0; k < undecided.size(); ++k) {
    groups_[undecided[k]].is_predicted = tests[k] && tests[k]->is_sharp;
    if (tests[k]) {
      order.emplace_back(undecided[k], *tests[k]);
    }
  }
  std::stable_sort(order.begin(), order.end(),
                   [](const auto& a, const auto& b) { return a.second.weight < b.second.weight; });
  for (auto& [i, tested] : order) {
    GatedGroup& group = groups_[i];
    if (known_->numEdges() > num_known && !confirms(tested, group)) {
      tested = *test(group, tested.weight);
    }
    group.is_predicted = tested.is_sharp;
    if (confirms(tested, group)) {
      accept(&group);
    } else if (tested.is_sharp && tested.log_evidence < std::log(kChance)) {
      group.verdict = LoopVerdict::kContradicted;
    }
  }
  return known_->numEdges() > num_known;
}

std::vector<std::optional<LoopGate::Test>> LoopGate::testAll(const std::vector<size_t>& groups,
                                                             double max_weight) const {
  std::vector<std::optional<Test>> tests(groups.size());
  tbb::parallel_for(size_t{0}, groups.size(),
                    [&](size_t i) { tests[i] = test(groups_[groups[i]], max_weight); });
  return tests;
}

void LoopGate::accept(GatedGroup* group) {
  group->verdict = LoopVerdict::kAccepted;
  for (const size_t i : group->loops) {
    known_->addEdge(loops_[i].first, loops_[i].second, loops_[i].measured);
  }
}

bool LoopGate::isOfOtherPlace(const GatedGroup& a, const GatedGroup& b) const {
  const auto apart = [](size_t i, size_t j) { return std::max(i, j) - std::min(i, j) > kPlaceSteps; };
  return std::all_of(a.loops.begin(), a.loops.end(), [&](size_t i) {
    return std::all_of(b.loops.begin(), b.loops.end(), [&](size_t j) {
      return apart(loops_[i].first, loops_[j].first) || apart(loops_[i].second, loops_[j].second);
    });
  });
}

LoopGate::Alliance LoopGate::supportersOf(size_t hypothesis, const std::vector<size_t>& undecided,
                                          const std::vector<Test>& alone) const {
  const double max_weight = kSupportSteps * step_weight_;
  const GatedGroup& group = groups_[undecided[hypothesis]];
  const auto middleOf = [this](const GatedGroup& of) { return loops_[of.loops[of.loops.size() / 2]]; };
  const OrderedLoop loop = middleOf(group);
  const auto from_first = known_->pathsWithin(loop.first, max_weight);
  const auto from_second = known_->pathsWithin(loop.second, max_weight);
  const double weight = known_->weightOf(loop.measured.covariance);
  std::vector<std::pair<size_t, Test>> tested;
  for (size_t j = 0; j < undecided.size(); ++j) {
    const OrderedLoop other = middleOf(groups_[undecided[j]]);
    const bool same_way = from_first[other.first] && from_second[other.second];
    const bool other_way = from_second[other.first] && from_first[other.second];
    if (j == hypothesis || !(same_way || other_way)) {
      continue;
    }
    const Path& to_first = same_way ? *from_first[other.first] : *from_second[other.first];
    const Path& to_second = same_way ? *from_second[other.second] : *from_first[other.second];
    tested.emplace_back(j, compare(other, {to_first.weight + weight + to_second.weight,
                                           inverseOf(to_first.first_from_second) *
                                               (same_way ? loop.measured : inverseOf(loop.measured)) *
                                               to_second.first_from_second}));
  }
  std::vector<std::pair<size_t, double>> gains;
  for (const auto& [j, test] : tested) {
    const double gain = test.log_evidence - std::max(0.0, alone[j].log_evidence);
    if (test.is_sharp && test.weight < alone[j].weight && gain > 0.0) {
      gains.emplace_back(undecided[j], gain);
    }
  }
  Alliance alliance{alone[hypothesis].log_evidence - minLogEvidence(group), {undecided[hypothesis]}};
  const double by_chance = logChoices(tested.size(), gains.size()) / static_cast<double>(gains.size());
  for (const auto& [other, gain] : gains) {
    const GatedGroup& supporter = groups_[other];
    if (gain > by_chance && std::all_of(alliance.groups.begin(), alliance.groups.end(),
                                        [&](size_t k) { return isOfOtherPlace(groups_[k], supporter); })) {
      alliance.log_evidence += gain - by_chance;
      alliance.groups.push_back(other);
    }
  }
  return alliance;
}

bool LoopGate::decideTogether() {
  const std::vector<size_t> undecided = undecidedGroups();
  std::vector<Test> alone;
  for (const std::optional<Test>& tested : testAll(undecided, kInfinity)) {
    alone.push_back(tested && tested->is_sharp ? *tested : Test{kInfinity, 0.0, false});
  }
  // The most likely ones suffice as hypotheses: what they confirm makes others likely.
  std::vector<size_t> hypotheses(undecided.size());
  std::iota(hypotheses.begin(), hypotheses.end(), size_t{0});
  std::stable_sort(hypotheses.begin(), hypotheses.end(),
                   [&](size_t a, size_t b) { return alone[a].log_evidence > alone[b].log_evidence; });
  hypotheses.resize(std::min(hypotheses.size(), kMaxHypotheses));
  std::vector<Alliance> alliances(hypotheses.size());
  tbb::parallel_for(size_t{0}, hypotheses.size(),
                    [&](size_t i) { alliances[i] = supportersOf(hypotheses[i], undecided, alone); });
  const Alliance* best = nullptr;
  for (const Alliance& alliance : alliances) {
    if (alliance.groups.size() > 1 && alliance.log_evidence > (best != nullptr ? best->log_evidence : 0.0)) {
      best = &alliance;
    }
  }
  for (const size_t i : best != nullptr ? best->groups : std::vector<size_t>()) {
    accept(&groups_[i]);
  }
  return best != nullptr;
}

void LoopGate::decide() {
  // Near loops first: they make the paths of far ones short, and quick to find.
  constexpr double kFirstSteps = 8.0;
  constexpr double kWidening = 8.0;
  const double first_weight = kFirstSteps * step_weight_;
  for (double max_weight = first_weight; max_weight < kWidening * odometry_weight_;) {
    const bool accepted = decideAlone(max_weight) || (max_weight > odometry_weight_ && decideTogether());
    max_weight = accepted ? first_weight : kWidening * max_weight;
  }
}

double LoopGate::priorOddsOfFalse() const {
  const auto num_accepted = std::count_if(groups_.begin(), groups_.end(), [](const GatedGroup& group) {
    return group.verdict == LoopVerdict::kAccepted;
  });
  const auto num_others = static_cast<std::ptrdiff_t>(groups_.size()) - num_accepted;
  return static_cast<double>(num_others + 1) / static_cast<double>(num_accepted + 1);
}

bool LoopGate::hearAgain(const std::map<int64_t, RigidTransform>& map_from_node) {
  std::vector<size_t> heard;
  for (size_t i = 0; i < groups_.size(); ++i) {
    if (groups_[i].verdict != LoopVerdict::kAccepted) {
      heard.push_back(i);
    }
  }
  const double needed = std::log(static_cast<double>(heard.size()) / kChanceAgain * priorOddsOfFalse());
  std::vector<char> agrees(heard.size(), 0);
  tbb::parallel_for(size_t{0}, heard.size(), [&](size_t k) {
    const std::vector<size_t> members = membersThatStandFor(groups_[heard[k]]);
    const auto num_agreeing = std::count_if(members.begin(), members.end(), [&](size_t i) {
      const OrderedLoop& loop = loops_[i];
      std::optional<Path> path = known_->path(loop.first, loop.second, kInfinity);
      path->first_from_second.first_from_second =
          map_from_node.at(nodes_[loop.first]).inverse() * map_from_node.at(nodes_[loop.second]);
      const Test tested = compare(loop, *path);
      return tested.is_sharp && tested.log_evidence > needed;
    });
    agrees[k] = 2 * static_cast<size_t>(num_agreeing) > members.size() ? 1 : 0;
  });
  for (size_t k = 0; k < heard.size(); ++k) {
    if (agrees[k] != 0) {
      accept(&groups_[heard[k]]);
    }
  }
  return std::count(agrees.begin(), agrees.end(), 1) > 0;
}

std::map<size_t, bool> LoopGate::agreeing(const std::map<int64_t, RigidTransform>& map_from_node) const {
  const double needed = std::log(kKeptOdds * priorOddsOfFalse());
  std::map<size_t, bool> agreeing;
  for (size_t i = 0; i < loops_.size(); ++i) {
    const OrderedLoop& loop = loops_[i];
    const RelativePose optimum = {
        map_from_node.at(nodes_[loop.first]).inverse() * map_from_node.at(nodes_[loop.second]),
        Matrix6d::Zero()};
    agreeing[edges_[i]] = compare(loop, {0.0, optimum}).log_evidence > needed;
  }
  return agreeing;
}

std::vector<GatedGroup> LoopGate::groups() const {
  std::vector<GatedGroup> groups = groups_;
  for (GatedGroup& group : groups) {
    for (size_t& loop : group.loops) {
      loop = edges_[loop];
    }
  }
  return groups;
}

std::map<int64_t, RigidTransform> LoopGate::placed() const {
  const auto placed = known_->placed();
  std::map<int64_t, RigidTransform> map_from_node;
  for (size_t i = 0; i < nodes_.size(); ++i) {
    map_from_node[nodes_[i]] = *placed[i];
  }
  return map_from_node;
}

}  // namespace vcharge
