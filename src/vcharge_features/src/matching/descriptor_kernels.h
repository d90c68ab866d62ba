#pragma once

#include <cstddef>
#include <cstdint>

#include "vcharge_features/descriptor_matching.h"

namespace vcharge {

// Distances between descriptors, vectorized; the instruction set is chosen at run time (Highway). Rows are
// `stride` elements apart.

constexpr size_t kBinaryDescriptorBytes = 32;

/// For each of `num_queries` binary descriptors the two nearest of `num_trains`, and, where `reverse` is not
/// null, for each train the nearest query. Hamming distances; equal ones are ordered by index.
void findTwoNearestBinary(const uint8_t* queries, size_t query_stride, size_t num_queries,
                          const uint8_t* trains, size_t train_stride, size_t num_trains,
                          TwoNearestDescriptors* forward, DescriptorNeighbour* reverse);

/// As findTwoNearestBinary for `columns` numbers per row; squared Euclidean distances.
void findTwoNearestFloat(const float* queries, size_t query_stride, size_t num_queries, const float* trains,
                         size_t train_stride, size_t num_trains, size_t columns,
                         TwoNearestDescriptors* forward, DescriptorNeighbour* reverse);

/// Hamming distances of a binary descriptor to `count` rows: to rows[i], or to rows[indices[i]] where
/// indices is not null.
void hammingToRows(const uint8_t* query, const uint8_t* rows, size_t stride, const int32_t* indices,
                   size_t count, float* distances);

/// As hammingToRows, squared Euclidean distances.
void squaredDistanceToRows(const float* query, size_t columns, const float* rows, size_t stride,
                           const int32_t* indices, size_t count, float* distances);

}  // namespace vcharge
