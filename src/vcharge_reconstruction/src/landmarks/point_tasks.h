#pragma once

#include <algorithm>
#include <cstddef>
#include <vector>

#include <tbb/parallel_for.h>

namespace vcharge {

/// Calls a function with the index of every point, in parallel, and sums the results in an order that does
/// not depend on scheduling.
template <class Function>
double sumOverPoints(size_t num_points, const Function& function) {
  constexpr size_t kPointsPerTask = 256;
  const size_t num_tasks = (num_points + kPointsPerTask - 1) / kPointsPerTask;
  std::vector<double> sums(num_tasks, 0.0);
  tbb::parallel_for(size_t{0}, num_tasks, [&](size_t task) {
    const size_t end = std::min(num_points, (task + 1) * kPointsPerTask);
    for (size_t point = task * kPointsPerTask; point < end; ++point) {
      sums[task] += function(point);
    }
  });
  double sum = 0.0;
  for (const double of_task : sums) {
    sum += of_task;
  }
  return sum;
}

}  // namespace vcharge
