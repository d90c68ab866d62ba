#pragma once

#include <memory>

#include <sensor_msgs/CameraInfo.h>
#include <sensor_msgs/Image.h>
#include <sensor_msgs/PointCloud2.h>

#include "vcharge_core/camera/ray_table.h"
#include "vcharge_core/dense_maps/range_map.h"

namespace vcharge {

/// One range map as messages with equal stamps in the camera's optical frame.
struct RangeMapMessages {
  sensor_msgs::ImagePtr range;               ///< 32FC1, metres along the ray, NaN if unknown
  sensor_msgs::ImagePtr confidence;          ///< 32FC1
  sensor_msgs::ImagePtr standard_deviation;  ///< 32FC1, metres
  sensor_msgs::ImagePtr reference;           ///< mono8: the undistorted image; null if it was not given
  sensor_msgs::CameraInfoPtr camera_info;    ///< equidistant fit of the working camera
  /// x, y, z (metres) and intensity (0..255), FLOAT32, known ranges only; null without with_points.
  sensor_msgs::PointCloud2Ptr points;
};

/// Converts the range maps of one camera; rays and camera_info are computed once per camera model and size.
/// Not thread safe.
class RangeMapConverter {
 public:
  /// camera_info is fitted over `field_of_view_rad` (full angle).
  explicit RangeMapConverter(double field_of_view_rad);
  ~RangeMapConverter();

  /// `gray` (CV_8UC1 of the map's size, the undistorted image, or empty) becomes the points' intensity;
  /// without it intensity is the confidence times 255. std::logic_error for images of different size or of
  /// another type.
  RangeMapMessages convert(const RangeMap& map, const cv::Mat& gray, bool with_points = true);

 private:
  void prepare(const RangeMap& map);
  sensor_msgs::PointCloud2Ptr makePoints(const RangeMap& map, const cv::Mat& gray) const;

  const double field_of_view_rad_;
  MeiCamera::Parameters camera_parameters_ = MeiCamera::Parameters::Zero();
  std::unique_ptr<RayTable> rays_;
  sensor_msgs::CameraInfo camera_info_;
};

}  // namespace vcharge
