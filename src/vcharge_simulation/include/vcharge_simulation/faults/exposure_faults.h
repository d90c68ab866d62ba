#pragma once

#include <optional>
#include <string>
#include <vector>

#include <opencv2/core.hpp>

#include "vcharge_core/base/timestamp.h"
#include "vcharge_simulation/faults/fault_options.h"
#include "vcharge_simulation/sensors/exposure_control.h"

namespace vcharge {

/// The exposure of each image: exposure steps, gains of cameras and automatic exposure. For every image of a
/// camera, in order, call next() and then observe(). Not thread safe.
class ExposureFaults {
 public:
  struct Record {
    Timestamp stamp;  ///< true stamp
    double time_s, gain;
  };

  /// `start` is the start of the drive; `exposure_gain` multiplies every exposure.
  ExposureFaults(const FaultOptions& faults, const std::vector<std::string>& cameras,
                 const CameraResponse& response, Timestamp start, double exposure_gain = 1.0);

  /// Exposure of an image of this light (see CameraResponse::addNoise). An automatic exposure has settled at
  /// its first image.
  Exposure next(size_t camera, Timestamp stamp, const cv::Mat& light);
  /// The image (CV_8UC1) taken with the exposure of next().
  void observe(size_t camera, const cv::Mat& image);

  /// Automatic exposures, per camera.
  const std::vector<std::vector<Record>>& records() const { return records_; }

 private:
  FaultOptions faults_;
  std::vector<std::string> cameras_;
  CameraResponse response_;
  Timestamp start_;
  double exposure_gain_;
  std::vector<std::optional<ExposureControl>> controls_;  ///< per camera
  std::vector<double> mean_gray_;                         ///< last image, per camera
  std::vector<std::vector<Record>> records_;
};

}  // namespace vcharge
