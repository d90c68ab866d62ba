#include "vcharge_localization/drive_experiment.h"

#include <algorithm>
#include <utility>

namespace vcharge {
namespace {

bool isWithin(const std::optional<std::pair<double, double>>& period_s, double time_s) {
  return period_s && time_s >= period_s->first && time_s < period_s->second;
}

}  // namespace

DriveExperiment::DriveExperiment(DriveExperimentOptions options) : options_(std::move(options)) {}

bool DriveExperiment::apply(ImageFrame* frame) {
  if (!first_) {
    first_ = frame->stamp;
  }
  const double time_s = toSeconds(frame->stamp - *first_);
  if (isWithin(options_.carry_s, time_s)) {
    return false;
  }
  if (frame->odom_from_vehicle) {
    if (options_.carry_s && time_s < options_.carry_s->first) {
      before_carrying_ = frame->odom_from_vehicle;
    } else if (before_carrying_) {
      shown_from_true_odom_ = *before_carrying_ * frame->odom_from_vehicle->inverse();
      before_carrying_.reset();
    }
    frame->odom_from_vehicle = shown_from_true_odom_ * *frame->odom_from_vehicle;
  }
  for (size_t i = 0; i < frame->images.size(); ++i) {
    const bool is_used =
        options_.cameras.empty() ||
        std::find(options_.cameras.begin(), options_.cameras.end(), i) != options_.cameras.end();
    if (!is_used) {
      frame->images[i] = Image();
    } else if (isWithin(options_.cover_s, time_s) && !frame->images[i].pixels.empty()) {
      frame->images[i] = {cv::Mat(frame->images[i].pixels.size(), CV_8UC1, cv::Scalar(4)), nullptr};
    }
  }
  return true;
}

}  // namespace vcharge
