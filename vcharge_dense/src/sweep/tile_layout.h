#pragma once

#include <cstddef>

namespace vcharge {

/// Order of a tile's pixels in the kernels' memory: its columns are cut into one strip per lane of a vector,
/// and the pixels at the same position of all strips are adjacent. A running sum along the columns is then a
/// loop over vectors without shuffles; only the last columns of a strip need those of the next lane.
struct TileLayout {
  int lanes = 1;
  int strip = 1;  ///< number of columns per strip
  int rows = 0;

  int columns() const { return lanes * strip; }
  size_t rowSize() const { return static_cast<size_t>(lanes) * static_cast<size_t>(strip); }
  size_t size() const { return static_cast<size_t>(rows) * rowSize(); }
  size_t index(int row, int column) const {
    return static_cast<size_t>(row) * rowSize() +
           static_cast<size_t>(column % strip) * static_cast<size_t>(lanes) +
           static_cast<size_t>(column / strip);
  }
};

}  // namespace vcharge
