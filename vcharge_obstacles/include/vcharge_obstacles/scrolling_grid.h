#pragma once

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <cstdlib>
#include <vector>

namespace vcharge {

/// A square window of cells in an infinite grid. Cells are stored at their index modulo the window's size, so
/// that moving the window copies none of them.
template <class Cell>
class ScrollingGrid {
 public:
  ScrollingGrid(int size, double cell_m) : size_(size), cell_m_(cell_m) { clear(); }

  int size() const { return size_; }  ///< cells along each side of the window
  /// Index of the window's lower corner; the window is [first, first + size) along both axes.
  int64_t firstX() const { return first_x_; }
  int64_t firstY() const { return first_y_; }
  int64_t indexOf(double coordinate_m) const {
    return static_cast<int64_t>(std::floor(coordinate_m / cell_m_));
  }
  bool isInside(int64_t x, int64_t y) const {
    return x >= first_x_ && x < first_x_ + size_ && y >= first_y_ && y < first_y_ + size_;
  }
  /// The cell of an index inside the window.
  Cell& at(int64_t x, int64_t y) { return cells_[slot(x, y)]; }
  const Cell& at(int64_t x, int64_t y) const { return cells_[slot(x, y)]; }
  /// Calls visit(x, y, cell) for all cells, row by row.
  template <class Visitor>
  void forEach(Visitor&& visit) const {
    for (int64_t y = first_y_; y < first_y_ + size_; ++y) {
      for (int64_t x = first_x_; x < first_x_ + size_; ++x) {
        visit(x, y, at(x, y));
      }
    }
  }
  /// All cells, in unspecified order.
  std::vector<Cell>& cells() { return cells_; }

  void clear() { cells_.assign(static_cast<size_t>(size_) * static_cast<size_t>(size_), Cell()); }
  /// Cells inside both the old and the new window keep their content; the others are reset.
  void moveTo(int64_t first_x, int64_t first_y) {
    if (std::abs(first_x - first_x_) >= size_ || std::abs(first_y - first_y_) >= size_) {
      clear();
    } else {
      // Incoming columns and rows reuse the storage of outgoing ones.
      for (int64_t x = std::min(first_x, first_x_); x < std::max(first_x, first_x_); ++x) {
        for (int64_t y = 0; y < size_; ++y) {
          at(x, y) = Cell();
        }
      }
      for (int64_t y = std::min(first_y, first_y_); y < std::max(first_y, first_y_); ++y) {
        for (int64_t x = 0; x < size_; ++x) {
          at(x, y) = Cell();
        }
      }
    }
    first_x_ = first_x;
    first_y_ = first_y;
  }

 private:
  int wrapped(int64_t index) const {
    const auto remainder = static_cast<int>(index % size_);
    return remainder < 0 ? remainder + size_ : remainder;
  }
  size_t slot(int64_t x, int64_t y) const {
    return static_cast<size_t>(wrapped(y)) * static_cast<size_t>(size_) + static_cast<size_t>(wrapped(x));
  }

  int size_;
  double cell_m_;
  int64_t first_x_ = 0, first_y_ = 0;
  std::vector<Cell> cells_;
};

}  // namespace vcharge
