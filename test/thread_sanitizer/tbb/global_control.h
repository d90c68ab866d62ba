#pragma once

#include <atomic>
#include <cstddef>
#include <limits>

// A replacement for oneTBB that ThreadSanitizer understands, see ../README.md.
namespace tbb {

/// Limits the number of threads; the newest living object counts.
class global_control {
 public:
  enum parameter { max_allowed_parallelism };
  global_control(parameter, size_t value) : before_(limit().exchange(value)) {}
  ~global_control() { limit() = before_; }
  global_control(const global_control&) = delete;
  global_control& operator=(const global_control&) = delete;

  static size_t allowed() { return limit(); }
  static size_t active_value(parameter) { return allowed(); }

 private:
  static std::atomic<size_t>& limit() {
    static std::atomic<size_t> value{std::numeric_limits<size_t>::max()};
    return value;
  }

  const size_t before_;
};

}  // namespace tbb
