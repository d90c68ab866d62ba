#pragma once

#include <opencv2/core.hpp>

#include "ground/point_warp.h"
#include "vcharge_core/motion/rigid_transform.h"

namespace vcharge {

/// An image (CV_8UC1) of a camera, and the camera's pose over level ground.
struct LevelView {
  const cv::Mat& image;
  const RigidTransform level_from_camera;
};

/// Pixels of the ground in rows of the newer of two images.
struct ComparedGround {
  const cv::Rect rows;
  const PixelPoints& points;  ///< around the newer camera
  const RigidTransform level_from_points;
  const cv::Mat& difference;  ///< CV_32FC1: newer brightness less that of the older image, 0 if unknown
  const float gain;           ///< by which the older image was multiplied
};

/// Tells what wet ground mirrors from what moves on it: brightness of the ground that changes as the vehicle
/// drives because the ground mirrors something else than before. What it mirrors is visible in the same
/// images above the ground: water at a horizontal range r, to which a ray falls by s per metre, mirrors at
/// the distance D what a ray rising by (1 - 2 r / D) s meets. Of that light water mirrors at most the part of
/// Fresnel's equations. What moves on the ground has no such counterpart. The distance is searched for.
///
/// Returns CV_32FC1, in the rows: part of the squared difference around a pixel that mirrored surroundings do
/// not explain; 1 where `asked` (CV_8UC1, in the rows) is 0. `warp` samples images of the camera.
cv::Mat unexplainedByReflection(const PointWarp& warp, const LevelView& now, const LevelView& before,
                                const ComparedGround& ground, const cv::Mat& asked);

}  // namespace vcharge
