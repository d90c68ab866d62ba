#pragma once

#include <opencv2/core.hpp>

#include "masks/static_structure.h"

namespace vcharge::internal {

/// What a pixel of a SmallView shows where it sees the scene, of the view's size.
struct SceneLevels {
  cv::Vec3f down;         ///< unit vector in the camera frame
  cv::Mat elevation_rad;  ///< CV_32FC1, of the ray over the horizon
  cv::Mat moving;         ///< CV_32FC1, median of StaticStructure::moving
  cv::Mat edge_noise;     ///< CV_32FC1, standard deviation of edge_x and edge_y
};

/// Over a drive with turns, the scene looks alike in all directions of one elevation: uniform ground below
/// the horizon, things of much structure around it, sky or ceiling above. Finds the vertical for which that
/// holds best, as the images are upright to within 25 degrees of roll, and the scene's levels by elevation.
/// The body may fill less than half of what is seen at an elevation; below the horizon, where it may fill all
/// of it, the whole ground counts.
SceneLevels findSceneLevels(const SmallView& view, const StaticStructure& structure);

}  // namespace vcharge::internal
