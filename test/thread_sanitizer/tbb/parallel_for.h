#pragma once

#include <algorithm>
#include <exception>
#include <mutex>
#include <thread>
#include <vector>

#include "blocked_range.h"
#include "global_control.h"

// A replacement for oneTBB that ThreadSanitizer understands, see ../README.md.
namespace tbb {

struct simple_partitioner {};

namespace stand_in {

inline thread_local bool in_loop = false;

/// Calls `run(i)` for 0 <= i < count on three threads, or on the calling thread inside another loop.
template <class Run>
void runAll(size_t count, const Run& run) {
  const size_t num_threads = in_loop ? 1 : std::min({count, size_t{3}, global_control::allowed()});
  if (num_threads <= 1) {
    for (size_t i = 0; i < count; ++i) {
      run(i);
    }
    return;
  }
  std::mutex mutex;
  std::exception_ptr error;
  std::vector<std::thread> threads;
  for (size_t t = 0; t < num_threads; ++t) {
    // Indices are assigned to the threads in turn, so that every thread also works on short loops.
    threads.emplace_back([&, t] {
      in_loop = true;
      try {
        for (size_t i = t; i < count; i += num_threads) {
          run(i);
        }
      } catch (...) {
        const std::lock_guard<std::mutex> lock(mutex);
        error = std::current_exception();
      }
    });
  }
  for (std::thread& thread : threads) {
    thread.join();
  }
  if (error) {
    std::rethrow_exception(error);
  }
}

}  // namespace stand_in

template <class Index, class Body>
void parallel_for(Index first, Index last, const Body& body) {
  if (first < last) {
    stand_in::runAll(static_cast<size_t>(last - first),
                     [&](size_t i) { body(static_cast<Index>(first + static_cast<Index>(i))); });
  }
}

template <class Value, class Body>
void parallel_for(const blocked_range<Value>& range, const Body& body, simple_partitioner = {}) {
  const size_t size = static_cast<size_t>(range.end() - range.begin());
  const size_t grain = std::max<size_t>(1, range.grainsize());
  stand_in::runAll((size + grain - 1) / grain, [&](size_t i) {
    const Value begin = range.begin() + static_cast<Value>(i * grain);
    body(blocked_range<Value>(begin, std::min(range.end(), begin + static_cast<Value>(grain)),
                              range.grainsize()));
  });
}

}  // namespace tbb
