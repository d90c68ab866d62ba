#include "light/ground_light.h"

#include <algorithm>
#include <cmath>

#include <opencv2/imgproc.hpp>

namespace vcharge {
namespace {

// Chosen on two simulated drives at dusk that are not used for evaluation.
// Earlier images count less by a factor of e after this path.
constexpr double kPath_m = 5.0;
constexpr double kMaxStep_m = 1.0;  // The path of one image counts up to this.
// Side of the smoothing window as a fraction of the image's width.
constexpr double kSmoothing = 0.107;
// Path after which the light is first used, and used in full.
constexpr double kFrom_m = 0.5, kFull_m = 2.5;
constexpr double kLargestFactor = 3.0;
// Rays that fall by more than this show the ground.
constexpr float kGroundFall = 0.1F;

}  // namespace

double GroundLight::meanOnGround() const {
  double sum = 0.0;
  size_t count = 0;
  for (size_t i = 0; i < rays_.size(); ++i) {
    if (rays_.z[i] < -kGroundFall) {
      sum += mean_.ptr<float>()[rays_.pixel[i]];
      ++count;
    }
  }
  return sum / static_cast<double>(std::max<size_t>(1, count));
}

cv::Mat GroundLight::even(const cv::Mat& image, const RigidTransform& fixed_from_vehicle) {
  const double step_m =
      fixed_from_last_
          ? std::min(kMaxStep_m, (fixed_from_vehicle.translation() - fixed_from_last_->translation()).norm())
          : 0.0;
  fixed_from_last_ = fixed_from_vehicle;
  const int side = std::max(1, cvRound(kSmoothing * image.cols));
  cv::Mat smooth;
  cv::boxFilter(image, smooth, CV_32F, cv::Size(side, side));
  path_m_ = path_m_ * std::exp(-step_m / kPath_m) + step_m;
  if (mean_.empty()) {
    mean_ = smooth;
  } else if (step_m > 0.0) {
    mean_ += (smooth - mean_) * (step_m / path_m_);
  }
  if (path_m_ <= kFrom_m) {
    return image;
  }
  const double exponent = std::min(1.0, (path_m_ - kFrom_m) / (kFull_m - kFrom_m));
  cv::Mat factor = meanOnGround() / (mean_ + 1.0);
  factor = cv::max(cv::min(factor, kLargestFactor), 1.0 / kLargestFactor);
  cv::pow(factor, exponent, factor);
  cv::Mat result;
  cv::multiply(image, factor, result, 1.0, CV_8U);
  return result;
}

void GroundLight::clear() {
  mean_.release();
  path_m_ = 0.0;
  fixed_from_last_.reset();
}

}  // namespace vcharge
