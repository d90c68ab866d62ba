#pragma once

#include <cstddef>

namespace vcharge {

/// One row of the fields. Rows begin at an aligned element and have kRowPadding elements before and after
/// them, which are NaN (values) or 0 (duals).
struct PrimalDualRow {
  float* value;
  float* extrapolated;
  const float* extrapolated_below;  ///< the next row
  float* dual_x;
  float* dual_y;
  const float* dual_y_above;  ///< the previous row
  const float* floor;
  const float* ceiling;
  const float* slope;
  const float* weight_below;
  const float* weight_above;
  size_t padded_columns;  ///< a multiple of kRowPadding
};

constexpr size_t kRowPadding = 16;  // elements of the widest vectors

struct PrimalDualSteps {
  float primal, dual;
  float dual_shrink;   ///< 1 / (1 + dual * epsilon)
  float below, above;  ///< slopes of the data cost times the primal step
  float low, high;
};

/// One iteration on one row: updates its duals, then its values.
using IterateRow = void (*)(const PrimalDualRow& row, const PrimalDualSteps& steps);
IterateRow iterateRowKernel();

}  // namespace vcharge
