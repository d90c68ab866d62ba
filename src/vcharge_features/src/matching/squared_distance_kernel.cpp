// The code keeps vectors in arrays, which is impossible for vectors of unknown size.
#define HWY_DISABLED_TARGETS (HWY_SVE | HWY_SVE2 | HWY_SVE_256 | HWY_SVE2_128 | HWY_RVV)
#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "matching/squared_distance_kernel.cpp"
#include <hwy/foreach_target.h>  // IWYU pragma: keep
//
#include <hwy/aligned_allocator.h>
#include <hwy/highway.h>

#include <algorithm>
#include <limits>

#include "matching/descriptor_kernels.h"

HWY_BEFORE_NAMESPACE();
namespace vcharge {
namespace HWY_NAMESPACE {
namespace {

namespace hn = hwy::HWY_NAMESPACE;

using DF = hn::ScalableTag<float>;
using DI = hn::ScalableTag<int32_t>;
using VF = hn::VFromD<DF>;
using VI = hn::VFromD<DI>;

/// Queries that use each loaded train together, which hides the latency of the sums.
constexpr size_t kTile = 8;
constexpr float kInfinity = std::numeric_limits<float>::infinity();

/// Stores column k of all trains of a group together; trains past the end are zero.
void packTrains(const float* trains, size_t stride, size_t num_trains, size_t columns, float* packed) {
  const size_t lanes = hn::Lanes(DF());
  const size_t num_groups = (num_trains + lanes - 1) / lanes;
  for (size_t i = 0; i < num_groups * lanes; ++i) {
    float* group = packed + (i - i % lanes) * columns + i % lanes;
    for (size_t k = 0; k < columns; ++k) {
      group[k * lanes] = i < num_trains ? trains[i * stride + k] : 0.0F;
    }
  }
}

/// The two nearest per lane, over groups in ascending order.
struct LaneNearest {
  float* best_distance;
  float* second_distance;
  int32_t* best_group;
  int32_t* second_group;

  HWY_INLINE void update(VF distances, int32_t group) const {
    const DF df;
    const DI di;
    const VI groups = hn::Set(di, group);
    const VF best = hn::Load(df, best_distance);
    const VI best_index = hn::Load(di, best_group);
    const VF second = hn::Load(df, second_distance);
    const auto nearer = hn::Lt(distances, best);
    const auto before_second = hn::Lt(distances, second);
    const VF not_best = hn::IfThenElse(before_second, distances, second);
    const VI not_best_index =
        hn::IfThenElse(hn::RebindMask(di, before_second), groups, hn::Load(di, second_group));
    hn::Store(hn::IfThenElse(nearer, best, not_best), df, second_distance);
    hn::Store(hn::IfThenElse(hn::RebindMask(di, nearer), best_index, not_best_index), di, second_group);
    hn::Store(hn::IfThenElse(nearer, distances, best), df, best_distance);
    hn::Store(hn::IfThenElse(hn::RebindMask(di, nearer), groups, best_index), di, best_group);
  }
};

void insertNearest(const DescriptorNeighbour& found, TwoNearestDescriptors* nearest) {
  const auto before = [](const DescriptorNeighbour& a, const DescriptorNeighbour& b) {
    return b.index < 0 || a.distance < b.distance || (a.distance == b.distance && a.index < b.index);
  };
  if (found.index < 0) {
    return;
  }
  if (before(found, nearest->best)) {
    nearest->second = nearest->best;
    nearest->best = found;
  } else if (before(found, nearest->second)) {
    nearest->second = found;
  }
}

/// Distances of 1 to kTile queries to a group.
template <size_t tile>
HWY_INLINE void tileDistances(const float* HWY_RESTRICT queries, size_t stride,
                              const float* HWY_RESTRICT group, size_t columns, VF* HWY_RESTRICT sums) {
  const DF df;
  VF sum[tile];
  for (size_t q = 0; q < tile; ++q) {
    sum[q] = hn::Zero(df);
  }
  for (size_t k = 0; k < columns; ++k) {
    const VF train = hn::Load(df, group + k * hn::Lanes(df));
    for (size_t q = 0; q < tile; ++q) {
      const VF difference = hn::Sub(train, hn::Set(df, queries[q * stride + k]));
      sum[q] = hn::MulAdd(difference, difference, sum[q]);
    }
  }
  for (size_t q = 0; q < tile; ++q) {
    sums[q] = sum[q];
  }
}

void findTwoNearestFloatTarget(const float* queries, size_t query_stride, size_t num_queries,
                               const float* trains, size_t train_stride, size_t num_trains, size_t columns,
                               TwoNearestDescriptors* forward, DescriptorNeighbour* reverse) {
  const DF df;
  const DI di;
  const size_t lanes = hn::Lanes(df);
  const size_t num_groups = (num_trains + lanes - 1) / lanes;
  const auto packed = hwy::AllocateAligned<float>(std::max<size_t>(1, num_groups * lanes * columns));
  packTrains(trains, train_stride, num_trains, columns, packed.get());
  const size_t states = std::max<size_t>(1, num_queries * lanes);
  const auto best_distance = hwy::AllocateAligned<float>(states);
  const auto second_distance = hwy::AllocateAligned<float>(states);
  const auto best_group = hwy::AllocateAligned<int32_t>(states);
  const auto second_group = hwy::AllocateAligned<int32_t>(states);
  std::fill_n(best_distance.get(), states, kInfinity);
  std::fill_n(second_distance.get(), states, kInfinity);
  std::fill_n(best_group.get(), states, -1);
  std::fill_n(second_group.get(), states, -1);
  HWY_ALIGN float lane_values[HWY_MAX_BYTES / sizeof(float)] = {};
  HWY_ALIGN int32_t lane_queries[HWY_MAX_BYTES / sizeof(int32_t)];

  for (size_t g = 0; g < num_groups; ++g) {
    const float* group = packed.get() + g * lanes * columns;
    for (size_t lane = 0; lane < lanes; ++lane) {
      lane_values[lane] = g * lanes + lane < num_trains ? 0.0F : kInfinity;
    }
    const VF past_end = hn::Load(df, lane_values);
    VF reverse_distance = hn::Set(df, kInfinity);
    VI reverse_query = hn::Set(di, -1);
    const auto update = [&](size_t q, VF distances) HWY_ATTR {
      const size_t at = q * lanes;
      const LaneNearest nearest{best_distance.get() + at, second_distance.get() + at, best_group.get() + at,
                                second_group.get() + at};
      nearest.update(hn::Add(distances, past_end), static_cast<int32_t>(g));
      const auto nearer = hn::Lt(distances, reverse_distance);
      reverse_distance = hn::IfThenElse(nearer, distances, reverse_distance);
      reverse_query =
          hn::IfThenElse(hn::RebindMask(di, nearer), hn::Set(di, static_cast<int32_t>(q)), reverse_query);
    };
    size_t q = 0;
    VF sums[kTile];
    for (; q + kTile <= num_queries; q += kTile) {
      tileDistances<kTile>(queries + q * query_stride, query_stride, group, columns, sums);
      for (size_t i = 0; i < kTile; ++i) {
        update(q + i, sums[i]);
      }
    }
    for (; q < num_queries; ++q) {
      tileDistances<1>(queries + q * query_stride, query_stride, group, columns, sums);
      update(q, sums[0]);
    }
    if (reverse != nullptr) {
      hn::Store(reverse_distance, df, lane_values);
      hn::Store(reverse_query, di, lane_queries);
      for (size_t lane = 0; lane < lanes && g * lanes + lane < num_trains; ++lane) {
        reverse[g * lanes + lane] = {lane_queries[lane], lane_values[lane]};
      }
    }
  }
  for (size_t q = 0; q < num_queries; ++q) {
    for (size_t lane = 0; lane < lanes; ++lane) {
      const size_t at = q * lanes + lane;
      const auto row = [&](int32_t group, float distance) {
        return DescriptorNeighbour{group < 0 ? -1 : static_cast<int32_t>(group * lanes + lane), distance};
      };
      insertNearest(row(best_group[at], best_distance[at]), &forward[q]);
      insertNearest(row(second_group[at], second_distance[at]), &forward[q]);
    }
  }
}

void squaredDistanceToRowsTarget(const float* query, size_t columns, const float* rows, size_t stride,
                                 const int32_t* indices, size_t count, float* distances) {
  const DF df;
  const size_t lanes = hn::Lanes(df);
  for (size_t i = 0; i < count; ++i) {
    const float* row = rows + (indices != nullptr ? static_cast<size_t>(indices[i]) : i) * stride;
    VF sum = hn::Zero(df);
    size_t k = 0;
    for (; k + lanes <= columns; k += lanes) {
      const VF difference = hn::Sub(hn::LoadU(df, query + k), hn::LoadU(df, row + k));
      sum = hn::MulAdd(difference, difference, sum);
    }
    float total = hn::GetLane(hn::SumOfLanes(df, sum));
    for (; k < columns; ++k) {
      total += (query[k] - row[k]) * (query[k] - row[k]);
    }
    distances[i] = total;
  }
}

}  // namespace
}  // namespace HWY_NAMESPACE
}  // namespace vcharge
HWY_AFTER_NAMESPACE();

#if HWY_ONCE
namespace vcharge {

HWY_EXPORT(findTwoNearestFloatTarget);
HWY_EXPORT(squaredDistanceToRowsTarget);

void findTwoNearestFloat(const float* queries, size_t query_stride, size_t num_queries, const float* trains,
                         size_t train_stride, size_t num_trains, size_t columns,
                         TwoNearestDescriptors* forward, DescriptorNeighbour* reverse) {
  std::fill_n(forward, num_queries, TwoNearestDescriptors());
  if (reverse != nullptr) {
    std::fill_n(reverse, num_trains, DescriptorNeighbour());
  }
  HWY_DYNAMIC_DISPATCH(findTwoNearestFloatTarget)
  (queries, query_stride, num_queries, trains, train_stride, num_trains, columns, forward, reverse);
}

void squaredDistanceToRows(const float* query, size_t columns, const float* rows, size_t stride,
                           const int32_t* indices, size_t count, float* distances) {
  HWY_DYNAMIC_DISPATCH(squaredDistanceToRowsTarget)
  (query, columns, rows, stride, indices, count, distances);
}

}  // namespace vcharge
#endif
