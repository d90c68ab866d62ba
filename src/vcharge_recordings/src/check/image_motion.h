#pragma once

#include <optional>
#include <vector>

#include <Eigen/Core>

#include "vcharge_core/base/timestamp.h"
#include "vcharge_core/camera/camera_rig.h"
#include "vcharge_features/patch_tracker.h"

namespace vcharge::internal {

/// A camera's motion from one image to a later one, from the images only.
struct ImageMotion {
  Timestamp begin, end;
  double flow_px = 0.0;  ///< median motion of a point in the sensor's image
  /// Rotation of the camera over [begin, end], in its own frame; absent if too few points agree.
  std::optional<Eigen::Vector3d> rotation_rad;
  /// Unit vector in the camera's frame at `begin`, if rotation_rad is present; meaningless if the camera only
  /// turns.
  Eigen::Vector3d direction = Eigen::Vector3d::UnitZ();
};

/// Measures the motion between every third image of one camera: corners are followed by their patches, and an
/// essential matrix (five-point, RANSAC) of their rays gives rotation and direction. Not thread safe.
class ImageMotionMeter {
 public:
  explicit ImageMotionMeter(const RigCamera& camera);

  /// Returns the motion since the last examined image; nullopt for images in between.
  std::optional<ImageMotion> add(Timestamp stamp, const cv::Mat& pixels);

 private:
  std::vector<Eigen::Vector3d> raysOf(const std::vector<cv::Point2f>& points_px) const;
  void estimate(const std::vector<cv::Point2f>& from_px, const std::vector<cv::Point2f>& to_px,
                ImageMotion* motion) const;

  const CameraModel model_;
  const cv::Size size_px_;
  double scale_;  // ratio of the small images' size to the sensor's
  cv::Mat mask_;  // for the small images
  PatchTracker tracker_;
  ImagePyramid last_;
  cv::Mat last_small_;
  Timestamp last_stamp_;
  int num_skipped_ = 0;
};

}  // namespace vcharge::internal
