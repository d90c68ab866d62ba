#pragma once

#include <algorithm>
#include <string>
#include <vector>

#include <Eigen/Core>

#include "vcharge_core/motion/rigid_transform.h"

namespace vcharge {

enum class BoardPattern { kChessboard, kAprilGrid };

/// A flat board to calibrate with: a grid of `columns` x `rows` corners at which two black and two white
/// quarters meet. The board's frame has its origin in the first corner, x along a row, y along a column.
///
/// A chessboard has inner corners between squares of `square_m`. An AprilGrid (Kalibr's) has square tags of
/// the family 36h11 with `square_m` sides and gaps of `tag_spacing` sides between them, in which small black
/// squares touch the tags' corners: four corners a tag, two rows and two columns of corners for each of tags.
/// Its first corner is the lower left one of tag 0, tags count to the right and then upwards.
struct CalibrationBoard {
  int columns = 9;  ///< of corners
  int rows = 6;     ///< of corners
  double square_m = 0.1;
  BoardPattern pattern = BoardPattern::kChessboard;
  double tag_spacing = 0.0;  ///< AprilGrid: gap over the tags' side

  /// Chessboard from "9x6" inner corners. std::invalid_argument for anything else, and for fewer than 3
  /// corners in a direction.
  static CalibrationBoard parse(const std::string& size, double square_m);
  /// std::invalid_argument naming what is not positive.
  static CalibrationBoard aprilGrid(int tag_columns, int tag_rows, double tag_m, double tag_spacing);

  int numCorners() const { return columns * rows; }
  /// Corner of index row * columns + column, in metres on the board (z = 0).
  Eigen::Vector3d corner(int index) const { return {along(index % columns), along(index / columns), 0.0}; }
  /// Within this distance of a corner, along x and along y, there are no edges but its own: up to the next
  /// corner, or to the code inside a tag's border of two tenths (Kalibr's).
  double clearance_m() const {
    return pattern == BoardPattern::kChessboard ? square_m : std::min(tag_spacing, 0.2) * square_m;
  }
  /// "chessboard of 9x6 inner corners".
  std::string description() const;

 private:
  double along(int place) const {
    if (pattern == BoardPattern::kChessboard) {
      return place * square_m;
    }
    const int tag = place / 2;
    return (tag * (1.0 + tag_spacing) + place % 2) * square_m;
  }
};

/// Where a board was held, and how it was bent there: boards held by hand bend by millimetres.
struct PlacedBoard {
  RigidTransform camera_from_board;
  /// Coefficients of x^2, x y and y^2 of the board's height along its z axis, metres, where x and y go from
  /// -1 to 1 over the corners. Zero: flat.
  Eigen::Vector3d bending_m = Eigen::Vector3d::Zero();

  /// x^2, x y and y^2 at a place on the board (metres).
  static Eigen::Vector3d bendingBasis(const CalibrationBoard& board, const Eigen::Vector2d& place_m) {
    const Eigen::Vector2d last = board.corner(board.numCorners() - 1).head<2>();
    const Eigen::Vector2d p = 2.0 * place_m.cwiseQuotient(last) - Eigen::Vector2d::Ones();
    return {p.x() * p.x(), p.x() * p.y(), p.y() * p.y()};
  }
  /// In the camera frame.
  Eigen::Vector3d point(const CalibrationBoard& board, const Eigen::Vector2d& place_m) const {
    return camera_from_board *
           Eigen::Vector3d(place_m.x(), place_m.y(), bending_m.dot(bendingBasis(board, place_m)));
  }
  Eigen::Vector3d corner(const CalibrationBoard& board, int index) const {
    return point(board, board.corner(index).head<2>());
  }
};

/// Reads Kalibr's description of a target: target_type aprilgrid (tagCols, tagRows, tagSize, tagSpacing) or
/// checkerboard (targetCols, targetRows, rowSpacingMeters, colSpacingMeters). InputError names file and key.
CalibrationBoard readCalibrationBoard(const std::string& path);

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
