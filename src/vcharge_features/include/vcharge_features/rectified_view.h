#pragma once

#include <cstddef>
#include <list>
#include <memory>
#include <optional>
#include <vector>

#include <Eigen/Core>
#include <Eigen/Geometry>
#include <opencv2/core.hpp>

#include "vcharge_core/base/options.h"
#include "vcharge_core/camera/camera_rig.h"
#include "vcharge_core/camera/pinhole_camera.h"
#include "vcharge_features/image_features.h"

namespace vcharge {

struct RectifiedViewOptions {
  VCHARGE_BEGIN_OPTIONS(RectifiedViewOptions);
  VCHARGE_OPTION(int, width_px, 800, between(16, 10000), "Width of the view.");
  VCHARGE_OPTION(int, height_px, 600, between(16, 10000), "Height of the view.");
  VCHARGE_OPTION(double, horizontal_field_of_view_rad, 1.5708, above(0.01).below(3.0),
                 "Horizontal field of view.");
  VCHARGE_END_OPTIONS();
};

/// View of a virtual pinhole camera with the centre of a fisheye camera and another orientation. Immutable.
class RectifiedView {
 public:
  /// Throws std::invalid_argument for bad options.
  RectifiedView(const RigCamera& camera, const Eigen::Quaterniond& view_from_camera,
                const RectifiedViewOptions& options = RectifiedViewOptions());

  const PinholeCamera& model() const { return model_; }
  const Eigen::Quaterniond& viewFromCamera() const { return view_from_camera_; }
  /// CV_8UC1: 255 where the ray is inside the camera's field of view, image and mask; otherwise 0.
  const cv::Mat& validMask() const { return valid_mask_; }
  /// Renders the view from an image (CV_8UC1 of the camera's size): bilinear, at 1/32 px; 0 where validMask()
  /// is 0. Throws std::invalid_argument for another image.
  cv::Mat rectify(const cv::Mat& image) const;

  /// Exact pixel of the fisheye image for a pixel of the view. Returns false and leaves the output unchanged
  /// where the view is not valid.
  bool toSensor(const Eigen::Vector2d& view_px, Eigen::Vector2d* sensor_px) const;
  /// Converts positions of features found in the view to the fisheye image; size and angle remain those of
  /// the view, like the descriptors. Features outside of the fisheye image are left out.
  ImageFeatures toSensor(const ImageFeatures& in_view) const;

 private:
  const CameraModel camera_;
  const cv::Size sensor_size_px_;
  const double min_cos_angle_;
  const Eigen::Quaterniond view_from_camera_;
  const PinholeCamera model_;
  cv::Mat valid_mask_;
  cv::Mat integer_map_, fraction_map_;  // from cv::convertMaps
};

/// Orientation of an upright view midway between two cameras, in a common frame: its x axis is perpendicular
/// to `up`. Empty if the cameras' axes differ by more than `max_angle_rad`, or the view would point along
/// `up`. Rotations are frame_from_camera.
std::optional<Eigen::Quaterniond> commonViewOrientation(const Eigen::Quaterniond& frame_from_first,
                                                        const Eigen::Quaterniond& frame_from_second,
                                                        const Eigen::Vector3d& up_in_frame,
                                                        double max_angle_rad);

struct RectifiedViewCacheOptions {
  VCHARGE_BEGIN_OPTIONS(RectifiedViewCacheOptions);
  VCHARGE_OPTION_GROUP(RectifiedViewOptions, view, {}, "The views.");
  VCHARGE_OPTION(int, max_pairs, 32, atLeast(1), "Number of pairs of views that are kept in memory.");
  VCHARGE_END_OPTIONS();
};

struct RectifiedPair {
  std::shared_ptr<const RectifiedView> first, second;
};

/// Pairs of views on a common image plane of two cameras of a rig at two times of a drive (paper, section
/// Inter-Camera Feature Matching), in which features are similar that the fisheye images show rotated and
/// distorted differently. Keeps the most recent pairs. Not thread safe.
class RectifiedViewCache {
 public:
  /// The vehicle's yaw between both images is rounded to this step, so that views can be reused.
  static constexpr double kYawStep_rad = 0.0436;

  /// Throws std::invalid_argument for bad options, std::logic_error for a rig without extrinsics.
  explicit RectifiedViewCache(std::shared_ptr<const CameraRig> rig,
                              const RectifiedViewCacheOptions& options = RectifiedViewCacheOptions());

  /// Views of cameras `first` and `second` of the rig, where the vehicle's yaw at the second image is
  /// `yaw_rad` ahead of that at the first. Their planes are parallel except for half a yaw step, roll and
  /// pitch. Empty if the cameras have no common view. Throws std::logic_error for a bad index or yaw.
  std::optional<RectifiedPair> pair(size_t first, size_t second, double yaw_rad);
  size_t numPairs() const { return pairs_.size(); }

 private:
  struct Entry {
    size_t first, second;
    int yaw_steps;
    RectifiedPair pair;
  };

  const std::shared_ptr<const CameraRig> rig_;
  const RectifiedViewCacheOptions options_;
  std::list<Entry> pairs_;  // most recently used first
};

}  // namespace vcharge
