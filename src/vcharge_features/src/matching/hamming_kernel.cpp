// AVX-512 with its population count is a separate target.
#define HWY_WANT_AVX3_DL
// The code keeps vectors in arrays, which is impossible for vectors of unknown size.
#define HWY_DISABLED_TARGETS (HWY_SVE | HWY_SVE2 | HWY_SVE_256 | HWY_SVE2_128 | HWY_RVV)
#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "matching/hamming_kernel.cpp"
#include <hwy/foreach_target.h>  // IWYU pragma: keep
//
#include <hwy/aligned_allocator.h>
#include <hwy/highway.h>

#include <algorithm>
#include <cstring>

#include "matching/descriptor_kernels.h"

HWY_BEFORE_NAMESPACE();
namespace vcharge {
namespace HWY_NAMESPACE {
namespace {

namespace hn = hwy::HWY_NAMESPACE;

/// `found` has a larger index than all in `nearest`, so it must be strictly nearer to precede them.
void mergeForward(const DescriptorNeighbour& found, TwoNearestDescriptors* nearest) {
  if (found.index < 0) {
    return;
  }
  if (nearest->best.index < 0 || found.distance < nearest->best.distance) {
    nearest->second = nearest->best;
    nearest->best = found;
  } else if (nearest->second.index < 0 || found.distance < nearest->second.distance) {
    nearest->second = found;
  }
}

#if HWY_TARGET == HWY_SCALAR
// Fallback for processors without vector instructions.

float hammingDistance(const uint8_t* a, const uint8_t* b) {
  size_t distance = 0;
  for (size_t k = 0; k < kBinaryDescriptorBytes; k += sizeof(uint64_t)) {
    uint64_t word_a, word_b;
    std::memcpy(&word_a, a + k, sizeof(word_a));
    std::memcpy(&word_b, b + k, sizeof(word_b));
    distance += hwy::PopCount(word_a ^ word_b);
  }
  return static_cast<float>(distance);
}

void findTwoNearestTarget(const uint8_t* queries, size_t query_stride, size_t num_queries,
                          const uint8_t* trains, size_t train_stride, size_t num_trains,
                          TwoNearestDescriptors* forward, DescriptorNeighbour* reverse) {
  for (size_t q = 0; q < num_queries; ++q) {
    for (size_t t = 0; t < num_trains; ++t) {
      const float distance = hammingDistance(queries + q * query_stride, trains + t * train_stride);
      mergeForward({static_cast<int>(t), distance}, &forward[q]);
      if (reverse != nullptr && (reverse[t].index < 0 || distance < reverse[t].distance)) {
        reverse[t] = {static_cast<int>(q), distance};
      }
    }
  }
}

void hammingToRowsTarget(const uint8_t* query, const uint8_t* rows, size_t stride, const int32_t* indices,
                         size_t count, float* distances) {
  for (size_t i = 0; i < count; ++i) {
    distances[i] =
        hammingDistance(query, rows + (indices != nullptr ? static_cast<size_t>(indices[i]) : i) * stride);
  }
}
#else

using D8 = hn::ScalableTag<uint8_t>;
using D16 = hn::ScalableTag<uint16_t>;
using D32 = hn::ScalableTag<uint32_t>;
using V16 = hn::VFromD<D16>;
using V32 = hn::VFromD<D32>;

constexpr size_t kWords = kBinaryDescriptorBytes / 4;
/// A key of 16 bits holds the distance (up to 256) and the number of a query or group within its block.
constexpr size_t kBlockBits = 7;
constexpr size_t kBlock = size_t{1} << kBlockBits;
constexpr uint16_t kNone = 0xFFFF;
/// At most 32 lanes with 16 bits.
constexpr size_t kLaneBits = 5;

/// Distances of one query to a group of trains: 16-bit lane i belongs to train i. In `trains`, the words of
/// even trains come first, then those of odd ones, both in 32-bit lanes.
HWY_INLINE V16 groupDistances(const V32* HWY_RESTRICT trains, const uint32_t* HWY_RESTRICT query) {
  const D16 d16;
  const D32 d32;
#if HWY_TARGET == HWY_AVX3_DL
  V32 even = hn::Zero(d32);
  V32 odd = hn::Zero(d32);
  for (size_t w = 0; w < kWords; ++w) {
    const V32 word = hn::Set(d32, query[w]);
    even = hn::Add(even, hn::PopulationCount(hn::Xor(word, trains[w])));
    odd = hn::Add(odd, hn::PopulationCount(hn::Xor(word, trains[kWords + w])));
  }
  return hn::BitCast(d16, hn::Or(even, hn::ShiftLeft<16>(odd)));
#else
  const D8 d8;
  // Byte counts stay below 256 over all words, so one sum across bytes at the end suffices.
  auto even = hn::Zero(d8);
  auto odd = hn::Zero(d8);
  for (size_t w = 0; w < kWords; ++w) {
    const V32 word = hn::Set(d32, query[w]);
    even = hn::Add(even, hn::PopulationCount(hn::BitCast(d8, hn::Xor(word, trains[w]))));
    odd = hn::Add(odd, hn::PopulationCount(hn::BitCast(d8, hn::Xor(word, trains[kWords + w]))));
  }
  const V16 low_byte = hn::Set(d16, 0x00FF);
  const V16 even16 = hn::BitCast(d16, even);
  const V16 odd16 = hn::BitCast(d16, odd);
  const V16 even_sums = hn::Add(hn::And(even16, low_byte), hn::ShiftRight<8>(even16));
  const V16 odd_sums = hn::Add(hn::And(odd16, low_byte), hn::ShiftRight<8>(odd16));
  const V16 low = hn::OddEven(hn::BitCast(d16, hn::ShiftLeft<16>(hn::BitCast(d32, odd_sums))), even_sums);
  const V16 high = hn::OddEven(odd_sums, hn::BitCast(d16, hn::ShiftRight<16>(hn::BitCast(d32, even_sums))));
  return hn::Add(low, high);
#endif
}

/// Arranges trains in the order in which groupDistances() reads them; those past the end are zero.
void packTrains(const uint8_t* trains, size_t stride, size_t num_trains, uint32_t* packed) {
  const size_t lanes = hn::Lanes(D32());
  const size_t group_size = 2 * lanes;
  const size_t padded = (num_trains + group_size - 1) / group_size * group_size;
  for (size_t i = 0; i < padded; ++i) {
    uint32_t words[kWords] = {};
    if (i < num_trains) {
      std::memcpy(words, trains + i * stride, sizeof(words));
    }
    const size_t lane = i % group_size;
    uint32_t* group = packed + (i - lane) * kWords + (lane % 2) * kWords * lanes + lane / 2;
    for (size_t w = 0; w < kWords; ++w) {
      group[w * lanes] = words[w];
    }
  }
}

DescriptorNeighbour unpackKey(uint32_t key, size_t first_train) {
  const uint32_t distance = key >> (kBlockBits + kLaneBits);
  if (distance > 8 * kBinaryDescriptorBytes) {
    return DescriptorNeighbour();
  }
  const uint32_t group = (key >> kLaneBits) & (kBlock - 1);
  const uint32_t lane = key & ((1U << kLaneBits) - 1);
  return {static_cast<int32_t>(first_train + group * hn::Lanes(D16()) + lane), static_cast<float>(distance)};
}

/// The two smallest keys over all lanes, made unique and ordered by train using group and lane.
void foldForward(const uint16_t* best_keys, const uint16_t* second_keys, size_t first_train,
                 TwoNearestDescriptors* nearest) {
  const D32 d32;
  const D16 d16;
  const hn::Half<D16> half16;
  const auto widen = [&](const uint16_t* keys, size_t start) {
    const V32 lane = hn::Iota(d32, static_cast<uint32_t>(start));
    return hn::Or(hn::ShiftLeft<kLaneBits>(hn::PromoteTo(d32, hn::Load(half16, keys + start))), lane);
  };
  const size_t middle = hn::Lanes(d16) / 2;
  const V32 best_low = widen(best_keys, 0);
  const V32 best_high = widen(best_keys, middle);
  const V32 best = hn::MinOfLanes(d32, hn::Min(best_low, best_high));
  const V32 none = hn::Set(d32, 0xFFFFFFFFU);
  const V32 others = hn::Min(hn::IfThenElse(hn::Eq(best_low, best), none, best_low),
                             hn::IfThenElse(hn::Eq(best_high, best), none, best_high));
  const V32 second =
      hn::MinOfLanes(d32, hn::Min(others, hn::Min(widen(second_keys, 0), widen(second_keys, middle))));
  mergeForward(unpackKey(hn::GetLane(best), first_train), nearest);
  mergeForward(unpackKey(hn::GetLane(second), first_train), nearest);
}

void findTwoNearestTarget(const uint8_t* queries, size_t query_stride, size_t num_queries,
                          const uint8_t* trains, size_t train_stride, size_t num_trains,
                          TwoNearestDescriptors* forward, DescriptorNeighbour* reverse) {
  const D16 d16;
  const D32 d32;
  const size_t group_size = hn::Lanes(d16);
  const size_t num_groups = (num_trains + group_size - 1) / group_size;
  const auto packed = hwy::AllocateAligned<uint32_t>(num_groups * group_size * kWords);
  packTrains(trains, train_stride, num_trains, packed.get());
  const auto words = hwy::AllocateAligned<uint32_t>(kBlock * kWords);
  const auto best_keys = hwy::AllocateAligned<uint16_t>(kBlock * group_size);
  const auto second_keys = hwy::AllocateAligned<uint16_t>(kBlock * group_size);
  HWY_ALIGN uint16_t lanes[HWY_MAX_BYTES / sizeof(uint16_t)];
  const V16 none = hn::Set(d16, kNone);

  for (size_t first_group = 0; first_group < num_groups; first_group += kBlock) {
    const size_t groups = std::min(kBlock, num_groups - first_group);
    for (size_t first_query = 0; first_query < num_queries; first_query += kBlock) {
      const size_t block_queries = std::min(kBlock, num_queries - first_query);
      for (size_t q = 0; q < block_queries; ++q) {
        std::memcpy(words.get() + q * kWords, queries + (first_query + q) * query_stride,
                    kBinaryDescriptorBytes);
        hn::Store(none, d16, best_keys.get() + q * group_size);
        hn::Store(none, d16, second_keys.get() + q * group_size);
      }
      for (size_t g = 0; g < groups; ++g) {
        const size_t first_train = (first_group + g) * group_size;
        V32 group[2 * kWords];
        for (size_t w = 0; w < 2 * kWords; ++w) {
          group[w] = hn::Load(d32, packed.get() + first_train * kWords + w * hn::Lanes(d32));
        }
        for (size_t lane = 0; lane < group_size; ++lane) {
          lanes[lane] = first_train + lane < num_trains ? static_cast<uint16_t>(g) : kNone;
        }
        const V16 group_key = hn::Load(d16, lanes);
        V16 reverse_keys = none;
        for (size_t q = 0; q < block_queries; ++q) {
          const V16 distances = hn::ShiftLeft<kBlockBits>(groupDistances(group, words.get() + q * kWords));
          const V16 keys = hn::Or(distances, group_key);
          uint16_t* best_of_query = best_keys.get() + q * group_size;
          uint16_t* second_of_query = second_keys.get() + q * group_size;
          const V16 best = hn::Load(d16, best_of_query);
          hn::Store(hn::Min(hn::Load(d16, second_of_query), hn::Max(best, keys)), d16, second_of_query);
          hn::Store(hn::Min(best, keys), d16, best_of_query);
          reverse_keys = hn::Min(reverse_keys, hn::Or(distances, hn::Set(d16, static_cast<uint16_t>(q))));
        }
        if (reverse == nullptr) {
          continue;
        }
        hn::Store(reverse_keys, d16, lanes);
        for (size_t lane = 0; lane < group_size && first_train + lane < num_trains; ++lane) {
          DescriptorNeighbour& nearest = reverse[first_train + lane];
          const auto distance = static_cast<float>(lanes[lane] >> kBlockBits);
          if (nearest.index < 0 || distance < nearest.distance) {
            nearest = {static_cast<int32_t>(first_query + (lanes[lane] & (kBlock - 1))), distance};
          }
        }
      }
      for (size_t q = 0; q < block_queries; ++q) {
        foldForward(best_keys.get() + q * group_size, second_keys.get() + q * group_size,
                    first_group * group_size, &forward[first_query + q]);
      }
    }
  }
}

void hammingToRowsTarget(const uint8_t* query, const uint8_t* rows, size_t stride, const int32_t* indices,
                         size_t count, float* distances) {
  const hn::CappedTag<uint8_t, kBinaryDescriptorBytes> d8;
  const hn::Repartition<uint64_t, decltype(d8)> d64;
  for (size_t i = 0; i < count; ++i) {
    const uint8_t* row = rows + (indices != nullptr ? static_cast<size_t>(indices[i]) : i) * stride;
    auto sum = hn::Zero(d64);
    for (size_t k = 0; k < kBinaryDescriptorBytes; k += hn::Lanes(d8)) {
      const auto differing = hn::Xor(hn::LoadU(d8, query + k), hn::LoadU(d8, row + k));
      sum = hn::Add(sum, hn::SumsOf8(hn::PopulationCount(differing)));
    }
    distances[i] = static_cast<float>(hn::GetLane(hn::SumOfLanes(d64, sum)));
  }
}
#endif

}  // namespace
}  // namespace HWY_NAMESPACE
}  // namespace vcharge
HWY_AFTER_NAMESPACE();

#if HWY_ONCE
namespace vcharge {

HWY_EXPORT(findTwoNearestTarget);
HWY_EXPORT(hammingToRowsTarget);

void findTwoNearestBinary(const uint8_t* queries, size_t query_stride, size_t num_queries,
                          const uint8_t* trains, size_t train_stride, size_t num_trains,
                          TwoNearestDescriptors* forward, DescriptorNeighbour* reverse) {
  std::fill_n(forward, num_queries, TwoNearestDescriptors());
  if (reverse != nullptr) {
    std::fill_n(reverse, num_trains, DescriptorNeighbour());
  }
  HWY_DYNAMIC_DISPATCH(findTwoNearestTarget)
  (queries, query_stride, num_queries, trains, train_stride, num_trains, forward, reverse);
}

void hammingToRows(const uint8_t* query, const uint8_t* rows, size_t stride, const int32_t* indices,
                   size_t count, float* distances) {
  HWY_DYNAMIC_DISPATCH(hammingToRowsTarget)(query, rows, stride, indices, count, distances);
}

}  // namespace vcharge
#endif
