#pragma once

#include <tbb/blocked_range.h>
#include <tbb/parallel_for.h>

namespace vcharge {

/// Calls function(row) for every row; the calls must not depend on each other.
template <class Function>
void forEachRow(int rows, const Function& function) {
  tbb::parallel_for(tbb::blocked_range<int>(0, rows, 16), [&](const tbb::blocked_range<int>& range) {
    for (int y = range.begin(); y < range.end(); ++y) {
      function(y);
    }
  });
}

}  // namespace vcharge
