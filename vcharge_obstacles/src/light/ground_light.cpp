#include "light/ground_light.h"

#include <algorithm>
#include <cmath>

#include <opencv2/imgproc.hpp>

namespace vcharge {
namespace {

// Chosen on two simulated drives at dusk that are not used for evaluation.
constexpr double kFade_m = 5.0;
// Side of the smoothing window as a fraction of the image's width.
constexpr double kSmoothing = 0.107;
// Path after which the light is first used, and used in full.
constexpr double kFrom_m = 0.5, kFull_m = 2.5;
constexpr double kLargestFactor = 3.0;
// Rays that fall by more than this show the ground.
constexpr float kGroundFall = 0.1F;

}  // namespace

GroundLight::GroundLight(const PixelRays& rays) : rays_(rays), path_(kFade_m) {}

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
  const int side = std::max(1, cvRound(kSmoothing * image.cols));
  cv::Mat smooth;
  cv::boxFilter(image, smooth, CV_32F, cv::Size(side, side));
  const double share = path_.moveTo(fixed_from_vehicle);
  if (mean_.empty()) {
    mean_ = smooth;
  } else if (share > 0.0) {
    mean_ += (smooth - mean_) * share;
  }
  const double path_m = path_.length_m();
  if (path_m <= kFrom_m) {
    return image;
  }
  const double exponent = std::min(1.0, (path_m - kFrom_m) / (kFull_m - kFrom_m));
  cv::Mat factor = meanOnGround() / (mean_ + 1.0);
  factor = cv::max(cv::min(factor, kLargestFactor), 1.0 / kLargestFactor);
  cv::pow(factor, exponent, factor);
  cv::Mat result;
  cv::multiply(image, factor, result, 1.0, CV_8U);
  return result;
}

void GroundLight::clear() {
  mean_.release();
  path_.clear();
}

}  // namespace vcharge
