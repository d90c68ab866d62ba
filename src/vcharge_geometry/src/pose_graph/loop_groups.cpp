#include "pose_graph/loop_groups.h"

#include <algorithm>
#include <numeric>

namespace vcharge {
namespace {

/// Largest number of odometry steps, at either end, between two loops that are compared.
constexpr size_t kMaxSteps = 5;

/// Simulated edges can be exact.
constexpr double kMinNoiseScale = 1e-9;

/// One in a hundred pairs of true loops is beyond; others join them.
double maxPairChiSquared(bool planar) {
  return planar ? 11.3 : 16.8;
}

struct Pair {
  size_t first;
  size_t second;
  double chi_squared;
};

/// Pose of node `to` relative to node `from` along the odometry.
RelativePose along(const std::vector<RelativePose>& steps, size_t from, size_t to) {
  RelativePose pose;
  for (size_t i = std::min(from, to); i < std::max(from, to); ++i) {
    pose = pose * steps[i];
  }
  return from <= to ? pose : inverseOf(pose);
}

std::vector<Pair> pairsOfNeighbours(const std::vector<OrderedLoop>& loops,
                                    const std::vector<RelativePose>& steps, bool planar) {
  std::vector<size_t> order(loops.size());
  std::iota(order.begin(), order.end(), size_t{0});
  std::stable_sort(order.begin(), order.end(),
                   [&](size_t a, size_t b) { return loops[a].first < loops[b].first; });
  std::vector<Pair> pairs;
  for (size_t i = 0; i < order.size(); ++i) {
    const OrderedLoop& a = loops[order[i]];
    for (size_t j = i + 1; j < order.size() && loops[order[j]].first <= a.first + kMaxSteps; ++j) {
      const OrderedLoop& b = loops[order[j]];
      if (std::max(a.second, b.second) - std::min(a.second, b.second) > kMaxSteps) {
        continue;
      }
      const RelativePose predicted =
          along(steps, a.first, b.first) * b.measured * along(steps, b.second, a.second);
      pairs.push_back({order[i], order[j], Disagreement(predicted, a.measured, planar).chiSquared()});
    }
  }
  return pairs;
}

/// The lower quartile is robust if up to three quarters of the pairs contain a false loop.
double noiseScale(const std::vector<Pair>& pairs, bool planar) {
  const double expected_quartile = planar ? 1.21 : 3.45;  // of chi^2 with 3 and 6 degrees of freedom
  if (pairs.empty()) {
    return 1.0;
  }
  std::vector<double> errors;
  for (const Pair& pair : pairs) {
    errors.push_back(pair.chi_squared);
  }
  const auto quartile = errors.begin() + static_cast<std::ptrdiff_t>(errors.size() / 4);
  std::nth_element(errors.begin(), quartile, errors.end());
  return std::clamp(*quartile / expected_quartile, kMinNoiseScale, 1.0);
}

}  // namespace

double maxConsistentChiSquared(bool planar) {
  return planar ? 30.7 : 38.3;
}

LoopGroups groupLoops(const std::vector<OrderedLoop>& loops, const std::vector<RelativePose>& steps,
                      bool planar, std::optional<double> noise_scale) {
  const std::vector<Pair> pairs = pairsOfNeighbours(loops, steps, planar);
  LoopGroups result;
  result.noise_scale = noise_scale ? *noise_scale : noiseScale(pairs, planar);
  // A disjoint-set forest, in which the root of a group is its first loop.
  std::vector<size_t> parent(loops.size());
  std::iota(parent.begin(), parent.end(), size_t{0});
  const auto rootOf = [&parent](size_t i) {
    while (parent[i] != i) {
      i = parent[i] = parent[parent[i]];
    }
    return i;
  };
  for (const Pair& pair : pairs) {
    if (pair.chi_squared < result.noise_scale * maxPairChiSquared(planar)) {
      const size_t a = rootOf(pair.first);
      const size_t b = rootOf(pair.second);
      parent[std::max(a, b)] = std::min(a, b);
    }
  }
  std::vector<size_t> group_of(loops.size());
  for (size_t i = 0; i < loops.size(); ++i) {
    const size_t root = rootOf(i);
    if (root == i) {
      group_of[i] = result.groups.size();
      result.groups.emplace_back();
    }
    result.groups[group_of[root]].push_back(i);
  }
  return result;
}

}  // namespace vcharge
