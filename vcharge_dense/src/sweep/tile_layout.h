#pragma once

#include <cstddef>

namespace vcharge {

/// How the kernels keep the pixels of a tile: its columns are cut into one strip per lane of a vector, and
/// the pixels at the same place of all strips lie together. A sum that runs along the columns is then a plain
/// loop over vectors, without shuffles, and only the last columns of a strip need those of the next lane.
struct TileLayout {
  int lanes = 1;
  int strip = 1;  ///< columns of a strip
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
