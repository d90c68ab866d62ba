#pragma once

#include <algorithm>
#include <limits>

#include <tbb/blocked_range.h>
#include <tbb/parallel_for.h>

namespace vcharge {

/// Calls function(row) for every row in parallel; the calls must not depend on each other.
template <class Function>
void forEachRow(int rows, const Function& function) {
  tbb::parallel_for(tbb::blocked_range<int>(0, rows, 16), [&](const tbb::blocked_range<int>& range) {
    for (int y = range.begin(); y < range.end(); ++y) {
      function(y);
    }
  });
}

/// Calls function(begin, end) for bands of rows in parallel; the bands do not depend on the number of
/// threads.
template <class Function>
void forEachBand(int rows, const Function& function) {
  constexpr int kBandRows = 32;
  tbb::parallel_for(0, (rows + kBandRows - 1) / kBandRows,
                    [&](int band) { function(band * kBandRows, std::min(rows, (band + 1) * kBandRows)); });
}

/// Copies a row and adds `margin` columns of NaN on both sides.
inline void copyPadded(const float* row, int columns, int margin, float* padded) {
  std::fill_n(padded, margin, std::numeric_limits<float>::quiet_NaN());
  std::copy_n(row, columns, padded + margin);
  std::fill_n(padded + margin + columns, margin, std::numeric_limits<float>::quiet_NaN());
}

}  // namespace vcharge
