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
  int width_px = 800;
  int height_px = 600;
  double horizontal_field_of_view_rad = 1.5708;

  template <class Visitor>
  void visitFields(Visitor&& visit) {
    visit("width_px", width_px);
    visit("height_px", height_px);
    visit("horizontal_field_of_view_rad", horizontal_field_of_view_rad);
  }
  void validate() const;  ///< throws std::invalid_argument naming the field
};

/// What a pinhole camera at the place of a fisheye camera, turned elsewhere, would see. Immutable.
class RectifiedView {
 public:
  /// std::invalid_argument for bad options.
  RectifiedView(const RigCamera& camera, const Eigen::Quaterniond& view_from_camera,
                const RectifiedViewOptions& options = RectifiedViewOptions());

  const PinholeCamera& model() const { return model_; }
  const Eigen::Quaterniond& viewFromCamera() const { return view_from_camera_; }
  /// CV_8UC1: 255 where the pixel's ray is inside the camera's field of view, image and mask; else 0.
  const cv::Mat& validMask() const { return valid_mask_; }

  /// The view of an image (CV_8UC1 of the camera's size): bilinear between pixels, at 1/32 px; 0 where
  /// validMask() is. std::invalid_argument for another image.
  cv::Mat rectify(const cv::Mat& image) const;

  /// Pixel of the fisheye image that shows what a pixel of the view shows, by the camera models themselves.
  /// False (output untouched) where the view is not valid.
  bool toSensor(const Eigen::Vector2d& view_px, Eigen::Vector2d* sensor_px) const;

  /// Moves features found in the view to the fisheye image, positions only: size and angle stay those of the
  /// view, in which the descriptors were made. Features without a place there are left out.
  ImageFeatures toSensor(const ImageFeatures& in_view) const;

 private:
  const CameraModel camera_;
  const cv::Size sensor_size_px_;
  const double min_cos_angle_;
  const Eigen::Quaterniond view_from_camera_;
  const PinholeCamera model_;
  cv::Mat valid_mask_;
  cv::Mat integer_map_, fraction_map_;  // as cv::convertMaps makes them
};

/// Orientation in a common frame of a view that looks midway between two cameras, upright: its x axis is
/// level with respect to `up`. Empty where the cameras' axes are more than `max_angle_rad` apart, or the view
/// would look along `up`. Rotations are frame_from_camera.
std::optional<Eigen::Quaterniond> commonViewOrientation(const Eigen::Quaterniond& frame_from_first,
                                                        const Eigen::Quaterniond& frame_from_second,
                                                        const Eigen::Vector3d& up_in_frame,
                                                        double max_angle_rad);

struct RectifiedViewCacheOptions {
  RectifiedViewOptions view;
  /// The vehicle's turn between the two images counts in steps, so that views can be used again.
  double yaw_step_rad = 0.0436;
  double max_axis_angle_rad = 2.4;  ///< cameras whose axes are further apart see nothing in common
  int max_pairs = 32;               ///< kept; the pair not used for the longest time goes first

  template <class Visitor>
  void visitFields(Visitor&& visit) {
    visit("view", view);
    visit("yaw_step_rad", yaw_step_rad);
    visit("max_axis_angle_rad", max_axis_angle_rad);
    visit("max_pairs", max_pairs);
  }
  void validate() const;  ///< throws std::invalid_argument naming the field
};

struct RectifiedPair {
  std::shared_ptr<const RectifiedView> first, second;
};

/// Pairs of views on a common image plane of two cameras of a rig, at two times of a drive (paper, section
/// Inter-Camera Feature Matching): features that the fisheye images show turned and squeezed differently look
/// alike there. Keeps what it made. Not thread safe.
class RectifiedViewCache {
 public:
  /// std::invalid_argument for bad options; std::logic_error for a rig without extrinsics.
  explicit RectifiedViewCache(std::shared_ptr<const CameraRig> rig,
                              const RectifiedViewCacheOptions& options = RectifiedViewCacheOptions());

  /// Views of cameras `first` and `second` (of the rig), when the vehicle's yaw at the second image is
  /// `yaw_rad` ahead of that at the first. Their planes are parallel but for half a yaw step, roll and pitch.
  /// Empty where the cameras look too far apart. std::logic_error for a bad index or yaw.
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
  std::list<Entry> pairs_;  // the one used last comes first
};

}  // namespace vcharge
