#pragma once

#include <algorithm>
#include <string>
#include <vector>

#include <Eigen/Core>

#include "vcharge_core/motion/rigid_transform.h"

namespace vcharge {

enum class BoardPattern { kChessboard, kAprilGrid };

/// A flat calibration board: a grid of `columns` x `rows` corners at which two black and two white quarters
/// meet. The origin of the board frame is the first corner, x along a row, y along a column.
/// A chessboard has inner corners between squares of `square_m`. An AprilGrid (Kalibr's) has square tags of
/// the family 36h11 with sides of `square_m` and gaps of `tag_spacing` sides, in which small black squares
/// touch the corners of the tags: four corners per tag, so two rows and columns of corners per row and column
/// of tags. Its first corner is the lower left one of tag 0; tags are counted to the right, then upwards.
struct CalibrationBoard {
  int columns = 9;  ///< number of corners in a row
  int rows = 6;     ///< number of corners in a column
  double square_m = 0.1;
  BoardPattern pattern = BoardPattern::kChessboard;
  double tag_spacing = 0.0;  ///< AprilGrid: ratio of the gap to the tags' side

  /// Creates a chessboard from its inner corners, for example "9x6". Throws std::invalid_argument for
  /// anything else, and for fewer than 3 corners in a direction.
  static CalibrationBoard parse(const std::string& size, double square_m);
  /// Throws std::invalid_argument naming the argument that is not positive.
  static CalibrationBoard aprilGrid(int tag_columns, int tag_rows, double tag_m, double tag_spacing);

  int numCorners() const { return columns * rows; }
  /// Position of the corner with index row * columns + column, in metres on the board (z = 0).
  Eigen::Vector3d corner(int index) const { return {along(index % columns), along(index / columns), 0.0}; }
  /// Distance from a corner, along x and y, within which there are only its own edges: up to the next corner,
  /// or to the code inside a tag's border of two tenths (Kalibr's).
  double clearance_m() const {
    return pattern == BoardPattern::kChessboard ? square_m : std::min(tag_spacing, 0.2) * square_m;
  }
  /// For example "chessboard of 9x6 inner corners".
  std::string description() const;

 private:
  double along(int line) const {
    if (pattern == BoardPattern::kChessboard) {
      return line * square_m;
    }
    const int tag = line / 2;
    return (tag * (1.0 + tag_spacing) + line % 2) * square_m;
  }
};

/// Pose and shape of a board in a view: hand-held boards bend by millimetres.
struct PosedBoard {
  RigidTransform camera_from_board;
  /// Coefficients of x^2, x y and y^2 of the board's height along its z axis, in metres, where x and y range
  /// from -1 to 1 over the corners. Zero for a flat board.
  Eigen::Vector3d bending_m = Eigen::Vector3d::Zero();

  /// Values of x^2, x y and y^2 at a position on the board (metres).
  static Eigen::Vector3d bendingBasis(const CalibrationBoard& board, const Eigen::Vector2d& position_m) {
    const Eigen::Vector2d last = board.corner(board.numCorners() - 1).head<2>();
    const Eigen::Vector2d p = 2.0 * position_m.cwiseQuotient(last) - Eigen::Vector2d::Ones();
    return {p.x() * p.x(), p.x() * p.y(), p.y() * p.y()};
  }
  /// Maps a position on the bent board to a point in the camera frame.
  Eigen::Vector3d point(const CalibrationBoard& board, const Eigen::Vector2d& position_m) const {
    return camera_from_board *
           Eigen::Vector3d(position_m.x(), position_m.y(), bending_m.dot(bendingBasis(board, position_m)));
  }
  Eigen::Vector3d corner(const CalibrationBoard& board, int index) const {
    return point(board, board.corner(index).head<2>());
  }
};

/// Reads Kalibr's description of a target: target_type aprilgrid (tagCols, tagRows, tagSize, tagSpacing) or
/// checkerboard (targetCols, targetRows, rowSpacingMeters, colSpacingMeters). Throws InputError naming file
/// and key.
CalibrationBoard readCalibrationBoard(const std::string& path);

/// A corner detected in an image.
struct BoardCorner {
  int index = 0;  ///< row * columns + column
  Eigen::Vector2d pixel{0.0, 0.0};
};

/// The corners of the board detected in an image.
struct BoardView {
  std::string image;  ///< name of the image
  std::vector<BoardCorner> corners;
};

}  // namespace vcharge
