#pragma once

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <vector>

namespace vcharge {

/// The entry at the given share, in [0, 1], of the sorted values; `values` must not be empty. At 0.5 the
/// median, of an even number the upper one.
inline double quantile(std::vector<double> values, double share) {
  const auto middle = values.begin() + std::lround(share * static_cast<double>(values.size() - 1));
  std::nth_element(values.begin(), middle, values.end());
  return *middle;
}

}  // namespace vcharge
