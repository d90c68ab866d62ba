#pragma once

#include <cstddef>
#include <cstdint>

#include "vcharge_features/descriptor_matching.h"

namespace vcharge {

// Vectorized distances between descriptors; the instruction set is chosen at run time (Highway). Rows are
// `stride` elements apart.

constexpr size_t kBinaryDescriptorBytes = 32;

/// Finds, for each of `num_queries` binary descriptors, the two nearest of `num_trains`, and, if `reverse` is
/// not null, for each train the nearest query. Hamming distances; ties are ordered by index.
void findTwoNearestBinary(const uint8_t* queries, size_t query_stride, size_t num_queries,
                          const uint8_t* trains, size_t train_stride, size_t num_trains,
                          TwoNearestDescriptors* forward, DescriptorNeighbour* reverse);

/// The same for rows of `columns` numbers and squared Euclidean distances.
void findTwoNearestFloat(const float* queries, size_t query_stride, size_t num_queries, const float* trains,
                         size_t train_stride, size_t num_trains, size_t columns,
                         TwoNearestDescriptors* forward, DescriptorNeighbour* reverse);

/// Hamming distances of a binary descriptor to `count` rows: rows[i], or rows[indices[i]] if indices is not
/// null.
void hammingToRows(const uint8_t* query, const uint8_t* rows, size_t stride, const int32_t* indices,
                   size_t count, float* distances);

/// The same with squared Euclidean distances.
void squaredDistanceToRows(const float* query, size_t columns, const float* rows, size_t stride,
                           const int32_t* indices, size_t count, float* distances);

}  // namespace vcharge
