#pragma once

#include <string>
#include <vector>

#include <Eigen/Core>
#include <opencv2/core.hpp>

#include "vcharge_core/motion/rigid_transform.h"

namespace vcharge {

/// What is printed on a calibration board. The sheet's frame has its origin in its middle, x to the right, y
/// down and z away from the viewer.
struct BoardPattern {
  cv::Mat image;  ///< CV_8UC1, row 0 is the upper edge
  double texels_per_m = 0.0;
  Eigen::Vector2d size_m{0.0, 0.0};
  /// The frame in which detectors give the corners: of a chessboard, the origin is its first inner corner, x
  /// runs along the 9 inner corners, y along the 6 and z away from the viewer; of an AprilGrid (as Kalibr has
  /// it) the origin is the lower left corner of tag 0, x runs to the right, y up and z towards the viewer.
  RigidTransform sheet_from_pattern;
  std::vector<Eigen::Vector3d> corners_in_pattern_m;  ///< inner corners, or the four of each tag from its
                                                      ///< lower left one counter-clockwise
  std::string target_yaml;                            ///< the pattern as a target file of Kalibr
};

/// "chessboard": 10 x 7 squares of 0.1 m. "aprilgrid": 6 x 6 tags of the family 36h11, 0.088 m wide with
/// borders of two bits, 0.3 of that apart, small squares between their corners; tag 0 is at the lower left,
/// the next to its right.
std::vector<std::string> listBoards();
/// std::invalid_argument that lists the names there are for an unknown one.
BoardPattern makeBoardPattern(const std::string& name);

}  // namespace vcharge
