#pragma once

#include <cstdint>
#include <optional>
#include <vector>

#include <Eigen/Core>
#include <opencv2/core.hpp>

#include "ground/point_warp.h"
#include "vcharge_core/camera/working_camera.h"
#include "vcharge_core/motion/rigid_transform.h"

namespace vcharge {

/// Where an object stands on the ground, as one camera measures it.
struct Contact {
  double range_m = 0.0;  ///< horizontal distance from the camera
  double sigma_m = 0.0;
};

/// Finds where the ground ends below something that stands on it, in one image: an earlier image is warped by
/// the known ground plane, and compared by normalized correlation, which a shadow on textured ground does not
/// change. The lowest part of an object that does not fit is where it touches the ground. Deterministic.
class GroundContact {
 public:
  GroundContact(const WorkingCamera& camera, const RigidTransform& vehicle_from_camera, double max_range_m);

  /// Compares two images (CV_8UC1 of the working camera); `before_from_now` is the motion of the vehicle.
  /// Where the ground mirrors, static reflections, which seem to lie below it, count as ground.
  void compare(const cv::Mat& now, const cv::Mat& before, const RigidTransform& before_from_now,
               bool is_mirror = false);
  /// Contact below a direction in the vehicle's axes; none if no ground is visible in front of it, or nothing
  /// has been compared.
  std::optional<Contact> below(const Eigen::Vector3d& ray_in_vehicle) const;
  /// The one contact of something upright that is seen between two azimuths (from `low_rad` counter-clockwise
  /// to `high_rad`), below a direction whose vertical slope is `slope`.
  std::optional<Contact> below(double low_rad, double high_rad, double slope) const;
  /// CV_8SC1: 1 where a pixel shows the ground, -1 where it does not, 0 where that is unknown.
  const cv::Mat& labels() const { return labels_; }

 private:
  /// Sets the labels where an earlier image, warped to rows_, tells them; `now` is smoothed and of rows_.
  void labelGround(const cv::Mat& now, const WarpedImage& before, cv::Mat* labels) const;
  int sectorOf(double azimuth_rad) const;
  std::optional<Contact> belowSectors(int first_sector, int num_sectors, double slope) const;
  int labelAt(int sector, int bin) const;

  const WorkingCamera camera_;
  const RigidTransform vehicle_from_camera_;
  const double height_m_;
  double bin_per_m_ = 0.0;  // width of a bin in inverse range
  double min_inverse_per_m_ = 0.0;
  int num_bins_ = 0;
  std::vector<int32_t> pixels_;  // of each sector and bin: row * columns + column, or -1
  cv::Rect rows_;                // part of the image that shows ground
  PixelPoints ground_;           // of the pixels in rows_ that show it, in the vehicle frame
  PointWarp warp_;
  cv::Mat labels_;
};

}  // namespace vcharge
