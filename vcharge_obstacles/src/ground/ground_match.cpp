#include "ground/ground_match.h"

#include <algorithm>
#include <cmath>
#include <utility>

#include <opencv2/imgproc.hpp>

#include "ground/plane_fit.h"
#include "vcharge_core/base/quantile.h"

namespace vcharge {
namespace {

// Images are smoothed over this window before they are compared.
constexpr int kSmoothing_px = 3;
constexpr int kWindow_px = PlaneFit::kWindow_px;
// Tolerated error of the warp.
constexpr int kSlack_px = 1;
// Pixels beyond the range limits that windows at the limits reach, as a fraction of the range.
constexpr float kBandMargin = 0.15F;
// The detector's default min_height_m: a pixel covers the strip where its ray is lower than this.
constexpr float kLow_m = 0.08F;
// Differences below this fraction of the brightness are noise.
constexpr float kRelativeDifference = 0.05F;
// The gain between two images is estimated from at least this number of pixels of this brightness or more.
constexpr size_t kMinCompared = 200;
// It is estimated from every one of so many pixels.
constexpr size_t kExposureStep = 8;
constexpr float kMinBrightness = 8.0F;
// The light on the ground is alike over windows of this side.
constexpr int kLight_px = 21;

/// CV_8UC1: not 0 where the windows of a warped image are known.
cv::Mat knownWindows(const WarpedImage& warped) {
  cv::Mat known;
  cv::erode(warped.known, known, cv::Mat::ones(kWindow_px, kWindow_px, CV_8U));
  return known;
}

/// Pixels of a camera's images that smoothing, windows and slack do not take beyond the valid ones.
cv::Mat innerPixels(const WorkingCamera& camera) {
  constexpr int kReach_px = 2 * (kSmoothing_px / 2 + kSlack_px) + 3;
  cv::Mat inner;
  cv::erode(camera.validMask(), inner, cv::Mat::ones(kReach_px, kReach_px, CV_8U), cv::Point(-1, -1), 1,
            cv::BORDER_CONSTANT, cv::Scalar(0));
  return inner;
}

/// CV_32FC1: ratio of the mean brightness around each pixel, of known pixels. It follows lamps and shadows of
/// the vehicle, which move over the ground.
cv::Mat localGain(const cv::Mat& now, const cv::Mat& on_ground, const cv::Mat& known) {
  cv::Mat compared, here, there, gain;
  now.copyTo(compared, known);
  cv::boxFilter(compared, here, CV_32F, cv::Size(kLight_px, kLight_px));
  on_ground.copyTo(compared, known);
  cv::boxFilter(compared, there, CV_32F, cv::Size(kLight_px, kLight_px));
  cv::divide(here, cv::max(there, 1.0), gain);
  return gain;
}

}  // namespace

GroundView::GroundView(Timestamp time, const cv::Mat& image, const RigidTransform& pose)
    : stamp(time), fixed_from_body(pose) {
  cv::blur(image, smooth, cv::Size(kSmoothing_px, kSmoothing_px));
  constexpr int side = 2 * kSlack_px + 1;
  const cv::Mat window = cv::Mat::ones(side, side, CV_8U);
  cv::erode(smooth, lowest, window);
  cv::dilate(smooth, highest, window);
}

GroundMatch::GroundMatch(const WorkingCamera& camera, const RigidTransform& vehicle_from_camera,
                         const PixelRays& rays, double min_difference)
    : vehicle_from_camera_(vehicle_from_camera),
      size_(camera.size()),
      rays_(rays),
      min_difference_(static_cast<float>(min_difference)),
      warp_(camera.model(), innerPixels(camera)) {}

/// Pixels of the newer image that matter, and the points of the ground that they show.
struct GroundMatch::Band {
  struct Pixel {
    size_t ray;
    float inverse;  // of the horizontal range to the ground
  };
  cv::Rect rows;
  float height_m = 0.0F;  // above the ground
  std::vector<Pixel> pixels;
  PixelPoints ground;  // of the inner ones
};

GroundMatch::Band GroundMatch::pixelsIn(const GroundPlane& ground, double near_m, double far_m) const {
  const Eigen::Vector3f camera = vehicle_from_camera_.translation().cast<float>();
  const auto slope_x = static_cast<float>(ground.slope.x());
  const auto slope_y = static_cast<float>(ground.slope.y());
  Band band;
  band.height_m =
      camera.z() - static_cast<float>(ground.offset_m) - slope_x * camera.x() - slope_y * camera.y();
  const auto near = static_cast<float>(near_m) * (1.0F - kBandMargin);
  const auto far = static_cast<float>(far_m) * (1.0F + kBandMargin);
  band.pixels.reserve(rays_.size());
  band.ground.reserve(rays_.size());
  for (size_t i = 0; i < rays_.size(); ++i) {
    const float fall = slope_x * rays_.x[i] + slope_y * rays_.y[i] - rays_.z[i];
    const float across = band.height_m * rays_.horizontal[i];
    if (fall * far > across && fall * near < across) {
      band.pixels.push_back({i, fall / across});
      if (warp_.isValid(rays_.pixel[i])) {
        band.ground.add(rays_.pixel[i], rays_.x[i], rays_.y[i], rays_.z[i], fall / band.height_m);
      }
    }
  }
  if (!band.pixels.empty()) {  // by row
    const int top = rays_.pixel[band.pixels.front().ray] / size_.width;
    const int bottom = rays_.pixel[band.pixels.back().ray] / size_.width + 1;
    band.rows = cv::Rect(0, top, size_.width, bottom - top);
  }
  return band;
}

std::vector<MatchedPixel> GroundMatch::compare(const GroundView& now, const GroundView& before,
                                               const GroundPlane& ground, double near_m, double far_m,
                                               Wanted wanted) const {
  const Band band = pixelsIn(ground, near_m, far_m);
  if (band.rows.empty()) {
    return {};
  }
  const RigidTransform before_from_now =
      (before.fixed_from_body * vehicle_from_camera_).inverse() * now.fixed_from_body;
  const auto warpBefore = [&](float inverse_range_factor) {
    return warp_.warp(before.smooth, before_from_now, vehicle_from_camera_.translation(), band.ground,
                      inverse_range_factor, band.rows);
  };
  const WarpedImage warped = warpBefore(1.0F);
  const cv::Mat on_ground = warped.image, knows_ground = knownWindows(warped);
  const cv::Mat here = now.smooth(band.rows);
  const int first_pixel = band.rows.y * size_.width;
  // The exposure may have changed. Most of the ground has not, so the median ratio is the gain.
  std::vector<double> ratios;
  for (size_t i = 0; i < band.pixels.size(); i += kExposureStep) {
    const int at = rays_.pixel[band.pixels[i].ray], in_rows = at - first_pixel;
    const float a = now.smooth.data[at], b = on_ground.data[in_rows];
    if (knows_ground.data[in_rows] != 0 && std::min(a, b) >= kMinBrightness) {
      ratios.push_back(a / b);
    }
  }
  if (ratios.size() * kExposureStep < kMinCompared) {
    return {};
  }
  const auto gain = static_cast<float>(quantile(std::move(ratios), 0.5));
  const cv::Mat local_gain = localGain(here, on_ground, knows_ground);
  cv::Mat keeps_texture, fit;
  if (wanted == Wanted::kAll) {
    const WarpedImage raised = warpBefore(band.height_m / (band.height_m - static_cast<float>(kRaised_m)));
    fit = fitPlanes(here, on_ground, raised.image, knownWindows(raised), &keeps_texture);
  } else {
    fit = cv::Mat(here.size(), CV_8UC1, cv::Scalar(PlaneFit::kUndecided));
    keeps_texture = keepsTexture(here, on_ground);
  }
  std::vector<MatchedPixel> result;
  result.reserve(band.pixels.size());
  const auto near_inverse = static_cast<float>(1.0 / near_m), far_inverse = static_cast<float>(1.0 / far_m);
  for (const Band::Pixel& pixel : band.pixels) {
    const int at = rays_.pixel[pixel.ray], in_rows = at - first_pixel;
    if (pixel.inverse > near_inverse || pixel.inverse < far_inverse || knows_ground.data[in_rows] == 0) {
      continue;
    }
    const int nearest = warped.nearest.ptr<int32_t>()[in_rows];
    const float brightness = now.smooth.data[at];
    const float tolerance = min_difference_ + kRelativeDifference * brightness;
    const float lowest = before.lowest.data[nearest], highest = before.highest.data[nearest];
    const auto differsWith = [&](float factor) {
      return brightness < factor * lowest - tolerance || brightness > factor * highest + tolerance;
    };
    const bool has_texture = keeps_texture.data[in_rows] != 0;
    const bool is_other_light = has_texture && !differsWith(local_gain.ptr<float>()[in_rows]);
    const bool differs = differsWith(gain) && !is_other_light;
    result.push_back({pixel.ray, pixel.inverse, pixel.inverse * band.height_m / (band.height_m - kLow_m),
                      fit.data[in_rows] == PlaneFit::kGround, fit.data[in_rows] == PlaneFit::kOther, differs,
                      has_texture});
  }
  return result;
}

}  // namespace vcharge
