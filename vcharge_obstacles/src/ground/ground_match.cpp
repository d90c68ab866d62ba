#include "ground/ground_match.h"

#include <algorithm>
#include <cmath>
#include <utility>

#include <opencv2/imgproc.hpp>

#include "ground/plane_fit.h"
#include "light/ground_reflection.h"
#include "vcharge_core/base/quantile.h"
#include "vcharge_core/base/wide_loops.h"

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

/// Directions of rays, and the lengths of their horizontal parts.
struct RayColumns {
  const float *x, *y, *z, *horizontal;
};

/// Inverse horizontal ranges at which rays meet a plane below the camera.
VCHARGE_WIDE_LOOPS void meetPlane(const RayColumns& rays, size_t count, float slope_x, float slope_y,
                                  float height_m, float* inverse_per_m) {
  const float *x = rays.x, *y = rays.y, *z = rays.z, *horizontal = rays.horizontal;
  for (size_t i = 0; i < count; ++i) {
    inverse_per_m[i] = (slope_x * x[i] + slope_y * y[i] - z[i]) / (height_m * horizontal[i]);
  }
}

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
  cv::Rect rows;
  std::vector<size_t> rays;  // by row
  PixelPoints ground;        // of the inner ones
};

/// The older image in a band's rows, as if it showed the ground.
struct GroundMatch::Compared {
  const cv::Mat &on_ground, &knows_ground;
  float gain;  // by which it has to be multiplied
};

GroundMatch::Ground GroundMatch::meet(const GroundPlane& plane) const {
  const Eigen::Vector3f camera = vehicle_from_camera_.translation().cast<float>();
  const auto slope_x = static_cast<float>(plane.slope.x());
  const auto slope_y = static_cast<float>(plane.slope.y());
  Ground ground;
  ground.height_m =
      camera.z() - static_cast<float>(plane.offset_m) - slope_x * camera.x() - slope_y * camera.y();
  ground.inverse_per_m.resize(rays_.size());
  meetPlane({rays_.x.data(), rays_.y.data(), rays_.z.data(), rays_.horizontal.data()}, rays_.size(), slope_x,
            slope_y, ground.height_m, ground.inverse_per_m.data());
  return ground;
}

GroundMatch::Band GroundMatch::pixelsIn(const Ground& ground, double near_m, double far_m) const {
  const auto largest = static_cast<float>(1.0 / near_m) / (1.0F - kBandMargin);
  const auto least = static_cast<float>(1.0 / far_m) / (1.0F + kBandMargin);
  Band band;
  band.rays.reserve(rays_.size());
  size_t num_inner = 0;
  for (size_t i = 0; i < rays_.size(); ++i) {
    if (ground.inverse_per_m[i] > least && ground.inverse_per_m[i] < largest) {
      band.rays.push_back(i);
      num_inner += warp_.isValid(rays_.pixel[i]) ? 1 : 0;
    }
  }
  band.ground.reserve(num_inner);
  for (const size_t i : band.rays) {
    if (warp_.isValid(rays_.pixel[i])) {
      band.ground.add(rays_.pixel[i], rays_.x[i], rays_.y[i], rays_.z[i],
                      ground.inverse_per_m[i] * rays_.horizontal[i]);
    }
  }
  if (!band.rays.empty()) {
    const int top = rays_.pixel[band.rays.front()] / size_.width;
    const int bottom = rays_.pixel[band.rays.back()] / size_.width + 1;
    band.rows = cv::Rect(0, top, size_.width, bottom - top);
  }
  return band;
}

std::vector<MatchedPixel> GroundMatch::compare(const GroundView& now, const GroundView& before,
                                               const Ground& ground, double near_m, double far_m,
                                               Wanted wanted, Reflections reflections) const {
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
  for (size_t i = 0; i < band.rays.size(); i += kExposureStep) {
    const int at = rays_.pixel[band.rays[i]], in_rows = at - first_pixel;
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
    const WarpedImage raised =
        warpBefore(ground.height_m / (ground.height_m - static_cast<float>(kRaised_m)));
    fit = fitPlanes(here, on_ground, raised.image, knownWindows(raised), &keeps_texture);
  } else {
    fit = cv::Mat(here.size(), CV_8UC1, cv::Scalar(PlaneFit::kUndecided));
    keeps_texture = keepsTexture(here, on_ground);
  }
  std::vector<MatchedPixel> result;
  result.reserve(band.rays.size());
  const auto near_inverse = static_cast<float>(1.0 / near_m), far_inverse = static_cast<float>(1.0 / far_m);
  const float to_low = ground.height_m / (ground.height_m - kLow_m);
  for (const size_t ray : band.rays) {
    const float inverse = ground.inverse_per_m[ray];
    const int at = rays_.pixel[ray], in_rows = at - first_pixel;
    if (inverse > near_inverse || inverse < far_inverse || knows_ground.data[in_rows] == 0) {
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
    const bool differs = differsWith(gain) && (!has_texture || differsWith(local_gain.ptr<float>()[in_rows]));
    result.push_back({ray, inverse, inverse * to_low, fit.data[in_rows] == PlaneFit::kGround,
                      fit.data[in_rows] == PlaneFit::kOther, differs, has_texture, 1.0F});
  }
  if (reflections == Reflections::kSought) {
    seekReflections(now, before, band, {on_ground, knows_ground, gain}, &result);
  }
  return result;
}

/// Finds which part of the differences of pixels that changed or are other is unexplained.
void GroundMatch::seekReflections(const GroundView& now, const GroundView& before, const Band& band,
                                  const Compared& compared, std::vector<MatchedPixel>* pixels) const {
  const int first_pixel = band.rows.y * size_.width;
  cv::Mat asked = cv::Mat::zeros(band.rows.size(), CV_8UC1);
  for (const MatchedPixel& pixel : *pixels) {
    if (pixel.is_changed || pixel.is_other) {
      asked.data[rays_.pixel[pixel.ray] - first_pixel] = 255;
    }
  }
  if (cv::countNonZero(asked) == 0) {
    return;
  }
  cv::Mat difference;
  cv::addWeighted(now.smooth(band.rows), 1.0, compared.on_ground, -compared.gain, 0.0, difference, CV_32F);
  difference.setTo(cv::Scalar(0.0), compared.knows_ground == 0);
  const cv::Mat unexplained = unexplainedByReflection(
      warp_, {now.smooth, now.fixed_from_body * vehicle_from_camera_},
      {before.smooth, before.fixed_from_body * vehicle_from_camera_},
      {band.rows, band.ground, now.fixed_from_body, difference, compared.gain}, asked);
  for (MatchedPixel& pixel : *pixels) {
    pixel.unexplained = unexplained.ptr<float>()[rays_.pixel[pixel.ray] - first_pixel];
  }
}

}  // namespace vcharge
