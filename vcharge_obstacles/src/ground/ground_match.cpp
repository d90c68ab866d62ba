#include "ground/ground_match.h"

#include <algorithm>
#include <cmath>
#include <opencv2/imgproc.hpp>

#include "ground/plane_fit.h"

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
constexpr float kMinBrightness = 8.0F;
// The light on the ground is alike over windows of this side.
constexpr int kLight_px = 21;

cv::Mat warped(const cv::Mat& before, const cv::Mat& map) {
  cv::Mat image;
  cv::remap(before, image, map, cv::Mat(), cv::INTER_LINEAR, cv::BORDER_CONSTANT, cv::Scalar(0));
  return image;
}

/// CV_8UC1: not 0 where the windows of a warped image are known.
cv::Mat knownIn(const cv::Mat& map) {
  cv::Mat channel, known;
  cv::extractChannel(map, channel, 0);
  known = channel >= 0.0;
  cv::erode(known, known, cv::Mat::ones(kWindow_px, kWindow_px, CV_8U));
  return known;
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
    : model_(camera.model()),
      vehicle_from_camera_(vehicle_from_camera),
      size_(camera.size()),
      rays_(rays),
      min_difference_(static_cast<float>(min_difference)) {
  // Smoothing, window and slack must not reach invalid pixels.
  const int reach = 2 * (kSmoothing_px / 2 + kSlack_px) + 3;
  cv::erode(camera.validMask(), valid_, cv::Mat::ones(reach, reach, CV_8U), cv::Point(-1, -1), 1,
            cv::BORDER_CONSTANT, cv::Scalar(0));
}

/// Pixels (CV_32FC2) of the older image that show what the newer one's pixels show, if that is the ground, or
/// the plane above it; only for rows of the newer image that matter. (-1, -1) where there is none.
struct GroundMatch::Warp {
  struct Pixel {
    size_t ray;
    float range_m, inverse, height_m;  // along the ray to the ground; inverse horizontal range
  };
  cv::Rect rows;
  cv::Mat ground, raised;  // raised: empty if not wanted
  std::vector<Pixel> pixels;
};

GroundMatch::Warp GroundMatch::warp(const RigidTransform& before_from_now, const GroundPlane& ground,
                                    double near_m, double far_m, Wanted wanted) const {
  const Eigen::Matrix3f rotation = before_from_now.rotationMatrix().cast<float>();
  const Eigen::Vector3f translation = before_from_now.translation().cast<float>();
  const Eigen::Vector3f camera = vehicle_from_camera_.translation().cast<float>();
  const auto slope_x = static_cast<float>(ground.slope.x());
  const auto slope_y = static_cast<float>(ground.slope.y());
  const float height =
      camera.z() - static_cast<float>(ground.offset_m) - slope_x * camera.x() - slope_y * camera.y();
  const auto near = static_cast<float>(near_m) * (1.0F - kBandMargin);
  const auto far = static_cast<float>(far_m) * (1.0F + kBandMargin);
  Warp result;
  result.pixels.reserve(rays_.size());
  int top = size_.height, bottom = 0;
  for (size_t i = 0; i < rays_.size(); ++i) {
    const float fall = slope_x * rays_.x[i] + slope_y * rays_.y[i] - rays_.z[i];
    const float across = height * rays_.horizontal[i];
    if (fall * far > across && fall * near < across) {
      result.pixels.push_back({i, height / fall, fall / across, height});
      const int row = rays_.pixel[i] / size_.width;
      top = std::min(top, row);
      bottom = std::max(bottom, row + 1);
    }
  }
  result.rows = top < bottom ? cv::Rect(0, top, size_.width, bottom - top) : cv::Rect();
  result.ground = cv::Mat(result.rows.size(), CV_32FC2, cv::Scalar::all(-1.0));
  result.raised = wanted == Wanted::kAll ? result.ground.clone() : cv::Mat();
  const auto xi = static_cast<float>(model_.xi());
  const auto project = [&](size_t i, float range_m, cv::Mat* map) {
    const Eigen::Vector3f point =
        rotation * (camera + range_m * Eigen::Vector3f(rays_.x[i], rays_.y[i], rays_.z[i])) + translation;
    const float denominator = point.z() + xi * point.norm();
    if (!(denominator > 0.1F * point.norm())) {
      return;
    }
    const cv::Vec2f at(
        static_cast<float>(model_.gamma1()) * point.x() / denominator + static_cast<float>(model_.u0()),
        static_cast<float>(model_.gamma2()) * point.y() / denominator + static_cast<float>(model_.v0()));
    const cv::Point nearest(cvRound(at[0]), cvRound(at[1]));
    if (cv::Rect(1, 1, size_.width - 2, size_.height - 2).contains(nearest) &&
        valid_.at<uint8_t>(nearest) != 0) {
      const int pixel = rays_.pixel[i];
      map->at<cv::Vec2f>(pixel / size_.width - top, pixel % size_.width) = at;
    }
  };
  const float raised = 1.0F - static_cast<float>(kRaised_m) / height;
  for (const Warp::Pixel& pixel : result.pixels) {
    if (valid_.data[rays_.pixel[pixel.ray]] != 0) {
      project(pixel.ray, pixel.range_m, &result.ground);
      if (wanted == Wanted::kAll) {
        project(pixel.ray, pixel.range_m * raised, &result.raised);
      }
    }
  }
  return result;
}

std::vector<MatchedPixel> GroundMatch::compare(const GroundView& now, const GroundView& before,
                                               const GroundPlane& ground, double near_m, double far_m,
                                               Wanted wanted) const {
  const RigidTransform before_from_now =
      (before.fixed_from_body * vehicle_from_camera_).inverse() * now.fixed_from_body;
  const Warp warp = this->warp(before_from_now, ground, near_m, far_m, wanted);
  if (warp.rows.empty()) {
    return {};
  }
  const cv::Mat on_ground = warped(before.smooth, warp.ground), knows_ground = knownIn(warp.ground);
  // The exposure may have changed. Most of the ground has not, so the median ratio is the gain.
  std::vector<float> ratios;
  for (const Warp::Pixel& pixel : warp.pixels) {
    const int at = rays_.pixel[pixel.ray], row = at / size_.width - warp.rows.y, column = at % size_.width;
    const float a = now.smooth.data[at], b = on_ground.at<uint8_t>(row, column);
    if (knows_ground.at<uint8_t>(row, column) != 0 && std::min(a, b) >= kMinBrightness) {
      ratios.push_back(a / b);
    }
  }
  if (ratios.size() < kMinCompared) {
    return {};
  }
  const auto middle = ratios.begin() + static_cast<std::ptrdiff_t>(ratios.size() / 2);
  std::nth_element(ratios.begin(), middle, ratios.end());
  const float gain = *middle;
  const cv::Mat local_gain = localGain(now.smooth(warp.rows), on_ground, knows_ground);
  const cv::Mat keeps_texture = keepsTexture(now.smooth(warp.rows), on_ground);
  cv::Mat fit(warp.rows.size(), CV_8UC1, cv::Scalar(0));
  if (wanted == Wanted::kAll) {
    fit =
        fitPlanes(now.smooth(warp.rows), on_ground, warped(before.smooth, warp.raised), knownIn(warp.raised));
  }
  std::vector<MatchedPixel> result;
  result.reserve(warp.pixels.size());
  const auto near_inverse = static_cast<float>(1.0 / near_m), far_inverse = static_cast<float>(1.0 / far_m);
  for (const Warp::Pixel& pixel : warp.pixels) {
    const int at = rays_.pixel[pixel.ray], row = at / size_.width - warp.rows.y, column = at % size_.width;
    if (pixel.inverse > near_inverse || pixel.inverse < far_inverse ||
        knows_ground.at<uint8_t>(row, column) == 0) {
      continue;
    }
    const cv::Vec2f source = warp.ground.at<cv::Vec2f>(row, column);
    const cv::Point nearest(cvRound(source[0]), cvRound(source[1]));
    const float brightness = now.smooth.data[at];
    const float tolerance = min_difference_ + kRelativeDifference * brightness;
    const float lowest = before.lowest.at<uint8_t>(nearest), highest = before.highest.at<uint8_t>(nearest);
    const auto differsWith = [&](float factor) {
      return brightness < factor * lowest - tolerance || brightness > factor * highest + tolerance;
    };
    const bool has_texture = keeps_texture.at<uint8_t>(row, column) != 0;
    const bool is_other_light = has_texture && !differsWith(local_gain.at<float>(row, column));
    const bool differs = differsWith(gain) && !is_other_light;
    result.push_back({pixel.ray, pixel.inverse, pixel.inverse * pixel.height_m / (pixel.height_m - kLow_m),
                      fit.at<uint8_t>(row, column) == PlaneFit::kGround,
                      fit.at<uint8_t>(row, column) == PlaneFit::kOther, differs, has_texture});
  }
  return result;
}

}  // namespace vcharge
