#pragma once

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <vector>

namespace vcharge {

/// The value at position `fraction` in [0, 1] of the sorted values, which must not be empty. 0.5 gives the
/// median; for an even count, the upper of the two middle values.
inline double quantile(std::vector<double> values, double fraction) {
  const auto middle = values.begin() + std::lround(fraction * static_cast<double>(values.size() - 1));
  std::nth_element(values.begin(), middle, values.end());
  return *middle;
}

}  // namespace vcharge
