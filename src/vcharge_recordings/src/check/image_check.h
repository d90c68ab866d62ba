#pragma once

#include <cstdint>
#include <string>
#include <vector>

#include <opencv2/core.hpp>

#include "check/check_findings.h"
#include "vcharge_core/camera/camera_rig.h"

namespace vcharge::internal {

/// Checks the images of one camera: size, repetitions, exposure, and edges that belong to the own vehicle.
class ImageCheck {
 public:
  explicit ImageCheck(const RigCamera& camera);

  /// Adds an image: counts repetitions of the image before, and examines the exposure of some images.
  void add(const cv::Mat& pixels);
  /// Adds an image taken after the vehicle has moved since the last image passed to this function.
  void addMoved(const cv::Mat& pixels);
  void judge(CheckFindings* findings) const;

 private:
  void judgeExposure(CheckFindings* findings) const;
  void judgeMask(CheckFindings* findings) const;

  const std::string name_;
  const cv::Size size_px_;
  cv::Mat valid_;  // CV_8UC1, of the size of the small images: 255 where the rig uses the pixel
  int64_t num_images_ = 0, num_wrong_size_ = 0, num_repeated_ = 0;
  cv::Size wrong_size_px_;
  cv::Mat last_;
  std::vector<double> means_, contrasts_, dark_fractions_, bright_fractions_;
  cv::Mat sum_x_, sum_y_, sum_length_, sum_square_;  // sums of gradients and of their lengths, CV_32FC1
  int num_moved_ = 0;
};

}  // namespace vcharge::internal
