#include "vcharge_simulation/sensors/lens_blur.h"

#include <algorithm>
#include <cmath>

#include <tbb/parallel_for.h>

#include "vcharge_core/base/error.h"

namespace vcharge {

namespace {

// A step with the kernel [a, 1 - 2 a, a] adds the variance 2 a. At a = 1/4 it removes the highest frequency;
// above, it would invert it.
constexpr double kMaxSpread = 0.25;
constexpr double kHalfPi = 1.57079632679489661923;

}  // namespace

void LensOptions::checkFields() const {
  requireField(blur_rim_px >= blur_axis_px, "blur_rim_px", "must be at least blur_axis_px", blur_rim_px);
}

double LensOptions::blurAt(double angle_rad, double image_scale) const {
  const double fraction = std::min(1.2, std::pow(angle_rad / kHalfPi, 1.5));
  return std::min(LensBlur::kMaxSigma_px,
                  image_scale * (blur_axis_px + (blur_rim_px - blur_axis_px) * fraction));
}

LensBlur::LensBlur(const cv::Mat& sigma_px) {
  check(sigma_px.type() == CV_32FC1, "LensBlur: expected CV_32FC1");
  double max_sigma_px = 0.0;
  cv::minMaxLoc(sigma_px, nullptr, &max_sigma_px);
  check(max_sigma_px <= kMaxSigma_px + 1e-6, "LensBlur: sigma_px is too large");
  num_steps_ = static_cast<int>(std::ceil(max_sigma_px * max_sigma_px / (2.0 * kMaxSpread)));
  if (num_steps_ > 0) {
    spread_ = sigma_px.mul(sigma_px, 0.5 / num_steps_);
  }
}

void LensBlur::apply(cv::Mat* light) const {
  check(num_steps_ == 0 || (light->type() == CV_32FC1 && light->size() == spread_.size()),
        "LensBlur::apply: the image must be CV_32FC1 of the size of sigma_px");
  cv::Mat along_rows(light->size(), CV_32FC1);
  const int last_column = light->cols - 1;
  const int last_row = light->rows - 1;
  for (int step = 0; step < num_steps_; ++step) {
    tbb::parallel_for(0, light->rows, [&](int y) {
      const float* in = light->ptr<float>(y);
      const float* spread = spread_.ptr<float>(y);
      float* out = along_rows.ptr<float>(y);
      out[0] = in[0] + spread[0] * (in[std::min(1, last_column)] - in[0]);
      for (int x = 1; x < last_column; ++x) {
        out[x] = in[x] + spread[x] * (in[x - 1] + in[x + 1] - 2.0F * in[x]);
      }
      out[last_column] =
          in[last_column] + spread[last_column] * (in[std::max(0, last_column - 1)] - in[last_column]);
    });
    tbb::parallel_for(0, light->rows, [&](int y) {
      const float* above = along_rows.ptr<float>(std::max(0, y - 1));
      const float* in = along_rows.ptr<float>(y);
      const float* below = along_rows.ptr<float>(std::min(last_row, y + 1));
      const float* spread = spread_.ptr<float>(y);
      float* out = light->ptr<float>(y);
      for (int x = 0; x <= last_column; ++x) {
        out[x] = in[x] + spread[x] * (above[x] + below[x] - 2.0F * in[x]);
      }
    });
  }
}

}  // namespace vcharge
