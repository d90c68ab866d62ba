#pragma once

#include <string>
#include <vector>

#include <Eigen/Core>
#include <opencv2/core.hpp>

#include "vcharge_core/motion/rigid_transform.h"

namespace vcharge {

/// Printed pattern of a calibration board. The sheet frame has its origin at the centre, x to the right, y
/// down and z away from the viewer.
struct BoardPattern {
  cv::Mat image;  ///< CV_8UC1, row 0 is the upper edge
  double texels_per_m = 0.0;
  Eigen::Vector2d size_m{0.0, 0.0};
  /// Frame of corners_in_pattern_m, as detectors report it. Chessboard: origin at the first inner corner, x
  /// along the 9 inner corners, y along the 6, z away from the viewer. AprilGrid (Kalibr's convention):
  /// origin at the lower left corner of tag 0, x to the right, y up, z towards the viewer.
  RigidTransform sheet_from_pattern;
  std::vector<Eigen::Vector3d>
      corners_in_pattern_m;  ///< inner corners of the chessboard, or the four corners of each tag,
                             ///< counter-clockwise from its lower left
  std::string target_yaml;   ///< Kalibr target file of the pattern
};

/// "chessboard": 10 x 7 squares of 0.1 m. "aprilgrid": 6 x 6 tags of family 36h11, 0.088 m wide with borders
/// of two bits, spaced by 0.3 tag widths with small squares between their corners; ids grow row by row from
/// the lower left.
std::vector<std::string> listBoards();
/// Throws std::invalid_argument for an unknown name, listing the known ones.
BoardPattern makeBoardPattern(const std::string& name);

}  // namespace vcharge
