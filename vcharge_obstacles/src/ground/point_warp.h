#pragma once

#include <cstdint>
#include <vector>

#include <opencv2/core.hpp>

#include "vcharge_core/camera/working_camera.h"
#include "vcharge_core/motion/rigid_transform.h"

namespace vcharge {

/// Points of the scene that pixels of an image show: each lies at an inverse range along a ray from a common
/// center. Structure of arrays.
struct PixelPoints {
  void reserve(size_t size);
  void add(int32_t at_pixel, float ray_x, float ray_y, float ray_z, float at_inverse_range_per_m);
  size_t size() const { return pixel.size(); }

  std::vector<int32_t> pixel;              ///< row * columns + column
  std::vector<float> x, y, z;              ///< ray, of any length
  std::vector<float> inverse_range_per_m;  ///< in lengths of the ray
};

/// What an older image shows at the points of a newer image's pixels, in rows of the newer image.
struct WarpedImage {
  cv::Mat image;    ///< CV_8UC1, bilinear; 0 where it is unknown
  cv::Mat known;    ///< CV_8UC1: 255 where the older image shows the point, otherwise 0
  cv::Mat nearest;  ///< CV_32SC1: row * columns + column of the older image; -1 where it is unknown
};

/// An image of which nothing is known.
WarpedImage unknownImage(cv::Size size);

/// Samples images of one camera where they show points that another image of it shows. Immutable.
class PointWarp {
 public:
  /// `valid`: CV_8UC1 of the camera's size, 0 where images must not be sampled.
  PointWarp(const MeiCamera& model, const cv::Mat& valid);

  bool isValid(int32_t pixel) const { return valid_.data[pixel] != 0; }

  /// `before` is the older image, `camera_from_points` its pose, `center` is in the points' frame, and the
  /// inverse ranges are multiplied by `inverse_range_factor` (0: points at infinity). Pixels without a point
  /// stay unknown.
  WarpedImage warp(const cv::Mat& before, const RigidTransform& camera_from_points,
                   const Eigen::Vector3d& center, const PixelPoints& points, float inverse_range_factor,
                   const cv::Rect& rows) const;
  /// The same in the memory of an image of the rows' size that is unknown, or was warped for the same pixels.
  void warpAgain(const cv::Mat& before, const RigidTransform& camera_from_points,
                 const Eigen::Vector3d& center, const PixelPoints& points, float inverse_range_factor,
                 const cv::Rect& rows, WarpedImage* warped) const;

 private:
  const MeiCamera model_;
  const cv::Mat valid_;
};

}  // namespace vcharge
