#pragma once

#include <cstddef>

#include <hwy/aligned_allocator.h>

namespace vcharge {

/// Array of numbers that is aligned for every vector size. Keeps its memory when it shrinks; resize() leaves
/// values undefined.
template <class T>
class AlignedArray {
 public:
  void resize(size_t size) {
    if (size > capacity_) {
      memory_ = hwy::AllocateAligned<T>(size);
      capacity_ = size;
    }
    size_ = size;
  }
  void assign(size_t size, T value) {
    resize(size);
    for (size_t i = 0; i < size; ++i) {
      memory_[i] = value;
    }
  }
  size_t size() const { return size_; }
  T* data() { return memory_.get(); }
  const T* data() const { return memory_.get(); }
  T& operator[](size_t i) { return memory_[i]; }
  const T& operator[](size_t i) const { return memory_[i]; }

 private:
  hwy::AlignedFreeUniquePtr<T[]> memory_;
  size_t size_ = 0, capacity_ = 0;
};

}  // namespace vcharge
