#pragma once

#include <string>
#include <vector>

#include <Eigen/Core>

namespace vcharge {

/// A chessboard: `columns` x `rows` inner corners, squares of `square_m`. The board's frame has its origin in
/// the first corner, x along a row, y along a column.
struct Chessboard {
  int columns = 9;
  int rows = 6;
  double square_m = 0.1;

  /// From "9x6". std::invalid_argument for anything else, and for fewer than 3 corners in a direction.
  static Chessboard parse(const std::string& size, double square_m);
  int numCorners() const { return columns * rows; }
  /// Corner of index row * columns + column, in metres on the board (z = 0).
  Eigen::Vector3d corner(int index) const {
    const int column = index % columns;
    const int row = index / columns;
    return {column * square_m, row * square_m, 0.0};
  }
};

/// A corner seen in an image.
struct BoardCorner {
  int index = 0;  ///< row * columns + column
  Eigen::Vector2d pixel{0.0, 0.0};
};

/// The corners of the board that an image shows.
struct BoardView {
  std::string image;  ///< the image's name
  std::vector<BoardCorner> corners;
};

}  // namespace vcharge
