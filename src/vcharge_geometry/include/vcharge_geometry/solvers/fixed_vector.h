#pragma once

#include <array>
#include <cstddef>

namespace vcharge {

/// Up to `Capacity` values without heap memory, returned by minimal solvers.
template <class T, int Capacity>
class FixedVector {
 public:
  static constexpr int kCapacity = Capacity;

  int size() const { return size_; }
  bool empty() const { return size_ == 0; }
  void clear() { size_ = 0; }
  /// Ignored if full.
  void push_back(const T& value) {
    if (size_ < Capacity) {
      values_[static_cast<size_t>(size_++)] = value;
    }
  }
  const T& operator[](int i) const { return values_[static_cast<size_t>(i)]; }
  T& operator[](int i) { return values_[static_cast<size_t>(i)]; }
  const T* begin() const { return values_.data(); }
  const T* end() const { return values_.data() + size_; }
  T* begin() { return values_.data(); }
  T* end() { return values_.data() + size_; }

 private:
  std::array<T, static_cast<size_t>(Capacity)> values_;
  int size_ = 0;
};

}  // namespace vcharge
