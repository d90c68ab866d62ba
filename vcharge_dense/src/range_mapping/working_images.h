#pragma once

#include <cstddef>
#include <memory>
#include <utility>
#include <vector>

#include <opencv2/core.hpp>

#include "range_mapping/inter_camera_stereo.h"
#include "vcharge_core/camera/rig_condition.h"
#include "vcharge_core/camera/working_camera.h"
#include "vcharge_core/frames/frame_assembler.h"

namespace vcharge {

/// The working images of one frame, undistorted at their first use.
class WorkingImages {
 public:
  /// Images of cameras that moved are not matched with those of others.
  WorkingImages(const ImageFrame& frame, std::vector<const WorkingCamera*> cameras,
                std::vector<Exposure> exposures, const RigCondition& condition,
                const InterCameraStereo* stereo)
      : frame_(frame),
        cameras_(std::move(cameras)),
        exposures_(std::move(exposures)),
        condition_(condition),
        stereo_(stereo),
        pixels_(cameras_.size()) {}

  const cv::Mat& of(size_t camera) {
    if (pixels_[camera].empty()) {
      pixels_[camera] = cameras_[camera]->undistort(frame_.images[camera].pixels);
    }
    return pixels_[camera];
  }

  const Exposure& exposureOf(size_t camera) const { return exposures_[camera]; }

  /// The images of all cameras if this one can be matched with some of them; otherwise null.
  std::shared_ptr<const InstantImages> instant(size_t camera) {
    if (stereo_ != nullptr && !instant_) {
      std::vector<cv::Mat> pixels(cameras_.size());
      for (size_t i = 0; i < cameras_.size(); ++i) {
        pixels[i] =
            cameras_[i] != nullptr && !condition_[i].has_moved && frame_.has_image[i] ? of(i) : cv::Mat();
      }
      instant_ = stereo_->instant(frame_.stamp, std::move(pixels), exposures_);
    }
    return instant_ && stereo_->canMeasure(*instant_, camera) ? instant_ : nullptr;
  }

 private:
  const ImageFrame& frame_;
  const std::vector<const WorkingCamera*> cameras_;
  const std::vector<Exposure> exposures_;
  const RigCondition& condition_;
  const InterCameraStereo* stereo_;
  std::vector<cv::Mat> pixels_;
  std::shared_ptr<const InstantImages> instant_;
};

}  // namespace vcharge
