#include "vcharge_simulation/faults/exposure_faults.h"

#include <limits>

#include <opencv2/imgproc.hpp>

namespace vcharge {

namespace {

constexpr int kSettlingSteps = 20;
constexpr int kSettlingImageStep = 4;  // a coarse image has the same mean

Exposure product(const Exposure& a, const Exposure& b) {
  return {a.factor * b.factor, a.gain * b.gain};
}

}  // namespace

ExposureFaults::ExposureFaults(const FaultOptions& faults, const std::vector<std::string>& cameras,
                               const CameraResponse& response, Timestamp start, double exposure_gain)
    : faults_(faults),
      cameras_(cameras),
      response_(response),
      start_(start),
      exposure_gain_(exposure_gain),
      controls_(cameras.size()),
      mean_gray_(cameras.size(), 0.0),
      records_(cameras.size()) {
  faults.validate();
}

Exposure ExposureFaults::next(size_t camera, Timestamp stamp, const cv::Mat& light) {
  const std::string& name = cameras_.at(camera);
  const Duration since_start = stamp - start_;
  Exposure exposure;
  exposure.factor = exposure_gain_;
  if (faults_.exposure_step.actsOn(name, since_start)) {
    exposure.factor *= faults_.exposure_step.gain;
  }
  if (faults_.camera_gains.actsOn(name, since_start)) {
    exposure.gain = faults_.camera_gains.gainOf(name);
  }
  std::optional<ExposureControl>& control = controls_[camera];
  const AutoExposureFault& automatic = faults_.auto_exposure;
  if (!automatic.actsOn(name, since_start)) {
    control.reset();
    return exposure;
  }
  if (control) {
    control->observe(response_, mean_gray_[camera], toSeconds(stamp - records_[camera].back().stamp));
  } else {
    control.emplace(automatic.target_gray, automatic.time_constant_s, automatic.normal_time_s);
    cv::Mat coarse;
    cv::resize(light, coarse, cv::Size(), 1.0 / kSettlingImageStep, 1.0 / kSettlingImageStep,
               cv::INTER_NEAREST);
    for (int i = 0; i < kSettlingSteps; ++i) {
      const cv::Mat image = response_.expose(coarse, product(exposure, control->exposure()));
      control->observe(response_, cv::mean(image)[0], std::numeric_limits<double>::infinity());
    }
  }
  exposure = product(exposure, control->exposure());
  records_[camera].push_back({stamp, exposure.factor * automatic.normal_time_s, exposure.gain});
  return exposure;
}

void ExposureFaults::observe(size_t camera, const cv::Mat& image) {
  mean_gray_.at(camera) = cv::mean(image)[0];
}

}  // namespace vcharge
