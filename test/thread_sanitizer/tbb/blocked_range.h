#pragma once

#include <cstddef>

// A replacement for oneTBB that ThreadSanitizer understands, see ../README.md.
namespace tbb {

template <class Value>
class blocked_range {
 public:
  blocked_range(Value begin, Value end, size_t grainsize = 1)
      : begin_(begin), end_(end), grainsize_(grainsize) {}
  Value begin() const { return begin_; }
  Value end() const { return end_; }
  size_t size() const { return static_cast<size_t>(end_ - begin_); }
  size_t grainsize() const { return grainsize_; }

 private:
  Value begin_, end_;
  size_t grainsize_;
};

}  // namespace tbb
