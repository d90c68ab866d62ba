#include "ground/plane_fit.h"

#include <algorithm>

#include "ground/image_windows.h"

namespace vcharge {
namespace {

// A larger window must show the ground too: small windows of a body fit by chance now and then.
constexpr int kHalf_px = PlaneFit::kWindow_px / 2, kWideHalf_px = 4;
// Standard deviation in gray levels from which a window has texture.
constexpr float kTexture = 1.2F;
// Correlations from which a window shows the plane, up to which it does not, and the least difference between
// two planes that decides.
constexpr float kSame = 0.7F, kOther = 0.4F, kDecisive = 0.15F;

/// Sets a row of the result of keepsTexture().
void keepTextureOf(const ImageWindows& wide, int columns, uint8_t* keeps) {
  const float* variance = wide.varianceBefore(0);
  const float* correlation = wide.correlation(0);
  for (int x = 0; x < columns; ++x) {
    keeps[x] = variance[x] >= kTexture * kTexture && correlation[x] >= kOther ? 255 : 0;
  }
}

}  // namespace

cv::Mat fitPlanes(const cv::Mat& now, const cv::Mat& on_ground, const cv::Mat& on_raised,
                  const cv::Mat& knows_raised, cv::Mat* keeps_texture) {
  ImageWindows windows(now, {on_ground, on_raised}, kHalf_px), wide(now, {on_ground}, kWideHalf_px);
  cv::Mat fits(now.size(), CV_8UC1);
  keeps_texture->create(now.size(), CV_8UC1);
  for (int row = 0; row < now.rows; ++row) {
    windows.nextRow();
    wide.nextRow();
    keepTextureOf(wide, now.cols, keeps_texture->ptr<uint8_t>(row));
    const auto* knows = knows_raised.ptr<uint8_t>(row);
    const float* variance = windows.variance();
    const float* variance_before = windows.varianceBefore(0);
    const float* on_ground_fit = windows.correlation(0);
    const float* on_raised_fit = windows.correlation(1);
    const float* wide_fit = wide.correlation(0);
    auto* result = fits.ptr<uint8_t>(row);
    for (int x = 0; x < now.cols; ++x) {
      const float fit = on_ground_fit[x], raised = knows[x] != 0 ? on_raised_fit[x] : 1.0F;
      result[x] = PlaneFit::kUndecided;
      if (std::min(variance[x], variance_before[x]) < kTexture * kTexture) {
        continue;
      }
      if (fit < kOther || raised >= fit + kDecisive) {
        result[x] = PlaneFit::kOther;
      } else if (fit >= kSame && fit >= raised + kDecisive && wide_fit[x] >= kSame) {
        result[x] = PlaneFit::kGround;
      }
    }
  }
  return fits;
}

cv::Mat keepsTexture(const cv::Mat& now, const cv::Mat& on_ground) {
  ImageWindows wide(now, {on_ground}, kWideHalf_px);
  cv::Mat keeps(now.size(), CV_8UC1);
  for (int row = 0; row < now.rows; ++row) {
    wide.nextRow();
    keepTextureOf(wide, now.cols, keeps.ptr<uint8_t>(row));
  }
  return keeps;
}

}  // namespace vcharge
