#include "vcharge_obstacles/ground_watch.h"

#include <algorithm>
#include <cmath>

#include <opencv2/imgproc.hpp>

#include "detection/pixel_rays.h"
#include "vcharge_core/base/error.h"
#include "vcharge_core/frames/bilinear_sample.h"

namespace vcharge {
namespace {

// Images are smoothed over this window before they are compared.
constexpr int kSmoothing_px = 3;
// Tolerated error of the warp.
constexpr int kSlack_px = 1;
// Desired age of the image that is compared with the current one; the nearest up to the maximum is used.
constexpr double kInterval_s = 0.24;
constexpr double kMaxInterval_s = 1.0;
// Differences below this fraction of the brightness are noise.
constexpr float kRelativeDifference = 0.05F;
// The gain between two images is estimated from at least this number of pixels of this brightness or more.
constexpr size_t kMinCompared = 200;
constexpr float kMinBrightness = 8.0F;

/// An image to compare later images with.
struct View {
  Timestamp stamp;
  RigidTransform fixed_from_body;
  cv::Mat smooth, lowest, highest;  // extremes within the slack
};

/// Pose of the tilted body over level ground.
RigidTransform levelFromBody(const GroundPlane& ground) {
  const Eigen::Vector3d normal(-ground.slope.x(), -ground.slope.y(), 1.0);
  const Eigen::Quaterniond rotation =
      Eigen::Quaterniond::FromTwoVectors(normal.normalized(), Eigen::Vector3d::UnitZ());
  return RigidTransform(rotation, Eigen::Vector3d(0.0, 0.0, -ground.offset_m / normal.norm()));
}

/// Brightness of a pixel now, and of the same ground in the earlier image.
struct Comparison {
  size_t ray;
  float from_inverse, to_inverse;  // strip of ground that the pixel covers, as inverse ranges
  float now, before, lowest, highest;
};

}  // namespace

struct GroundWatch::Implementation {
  Implementation(const WorkingCamera& camera, const RigidTransform& body_from_camera,
                 const PolarGrid& polar_grid, double furthest_m, const GroundWatchOptions& watch_options)
      : options((watch_options.validate(), watch_options)),
        max_distance_m(furthest_m),
        grid(polar_grid),
        model(camera.model()),
        vehicle_from_camera(body_from_camera),
        size(camera.size()),
        rays(camera, body_from_camera, grid) {
    // Smoothing and slack must not reach invalid pixels.
    const int reach = 2 * (kSmoothing_px / 2 + kSlack_px) + 3;
    cv::erode(camera.validMask(), valid, cv::Mat::ones(reach, reach, CV_8U), cv::Point(-1, -1), 1,
              cv::BORDER_CONSTANT, cv::Scalar(0));
  }

  View makeView(Timestamp stamp, const cv::Mat& image, const RigidTransform& fixed_from_body) const {
    View view{stamp, fixed_from_body, {}, {}, {}};
    cv::blur(image, view.smooth, cv::Size(kSmoothing_px, kSmoothing_px));
    constexpr int side = 2 * kSlack_px + 1;
    const cv::Mat window = cv::Mat::ones(side, side, CV_8U);
    cv::erode(view.smooth, view.lowest, window);
    cv::dilate(view.smooth, view.highest, window);
    return view;
  }
  const View* viewBefore(Timestamp stamp) const;
  std::vector<Comparison> comparePixels(const View& now, const View& before, const GroundPlane& ground) const;
  std::vector<float> changedFraction(const std::vector<Comparison>& pixels) const;

  const GroundWatchOptions options;
  const double max_distance_m;
  const PolarGrid grid;
  const MeiCamera model;
  const RigidTransform vehicle_from_camera;
  const cv::Size size;
  const PixelRays rays;
  cv::Mat valid;
  std::deque<View> views;
};

/// The view whose age is nearest to the interval; null if there is none.
const View* GroundWatch::Implementation::viewBefore(Timestamp stamp) const {
  const View* best = nullptr;
  for (const View& view : views) {
    const double age_s = toSeconds(stamp - view.stamp);
    const bool is_better = best == nullptr || std::abs(age_s - kInterval_s) <
                                                  std::abs(toSeconds(stamp - best->stamp) - kInterval_s);
    if (age_s > 0.0 && age_s <= kMaxInterval_s && is_better) {
      best = &view;
    }
  }
  return best;
}

std::vector<Comparison> GroundWatch::Implementation::comparePixels(const View& now, const View& before,
                                                                   const GroundPlane& ground) const {
  const RigidTransform before_from_now =
      (before.fixed_from_body * vehicle_from_camera).inverse() * now.fixed_from_body;
  const Eigen::Matrix3f rotation = before_from_now.rotationMatrix().cast<float>();
  const Eigen::Vector3f translation = before_from_now.translation().cast<float>();
  const Eigen::Vector3f camera = vehicle_from_camera.translation().cast<float>();
  const auto slope_x = static_cast<float>(ground.slope.x());
  const auto slope_y = static_cast<float>(ground.slope.y());
  const float height =
      camera.z() - static_cast<float>(ground.offset_m) - slope_x * camera.x() - slope_y * camera.y();
  const auto xi = static_cast<float>(model.xi());
  const auto max_distance = static_cast<float>(max_distance_m);
  // The detector's default min_height_m: a pixel covers the strip where its ray is lower than this.
  constexpr float kLow_m = 0.08F;
  std::vector<Comparison> pixels;
  pixels.reserve(rays.size() / 2);
  for (size_t i = 0; i < rays.size(); ++i) {
    const float fall = slope_x * rays.x[i] + slope_y * rays.y[i] - rays.z[i];
    if (fall * max_distance <= height * rays.horizontal[i] || valid.data[rays.pixel[i]] == 0) {
      continue;
    }
    const float range = height / fall;
    const Eigen::Vector3f point =
        rotation * (camera + range * Eigen::Vector3f(rays.x[i], rays.y[i], rays.z[i])) + translation;
    const float denominator = point.z() + xi * point.norm();
    if (denominator <= 0.1F) {
      continue;
    }
    const float u =
        static_cast<float>(model.gamma1()) * point.x() / denominator + static_cast<float>(model.u0());
    const float v =
        static_cast<float>(model.gamma2()) * point.y() / denominator + static_cast<float>(model.v0());
    if (!(u >= 1.0F && v >= 1.0F && u < static_cast<float>(size.width - 2) &&
          v < static_cast<float>(size.height - 2))) {
      continue;
    }
    const int nearest = static_cast<int>(std::lround(v)) * size.width + static_cast<int>(std::lround(u));
    if (valid.data[nearest] == 0) {
      continue;
    }
    const float inverse = 1.0F / (range * rays.horizontal[i]);
    pixels.push_back({i, inverse, inverse * height / (height - kLow_m),
                      static_cast<float>(now.smooth.data[rays.pixel[i]]), bilinearSample(before.smooth, u, v),
                      static_cast<float>(before.lowest.data[nearest]),
                      static_cast<float>(before.highest.data[nearest])});
  }
  return pixels;
}

std::vector<float> GroundWatch::Implementation::changedFraction(const std::vector<Comparison>& pixels) const {
  // The exposure may have changed. Most of the ground has not, so the median ratio is the gain.
  std::vector<float> ratios;
  ratios.reserve(pixels.size());
  for (const Comparison& pixel : pixels) {
    if (std::min(pixel.now, pixel.before) >= kMinBrightness) {
      ratios.push_back(pixel.now / pixel.before);
    }
  }
  if (ratios.size() < kMinCompared) {
    return {};
  }
  const auto middle = ratios.begin() + static_cast<std::ptrdiff_t>(ratios.size() / 2);
  std::nth_element(ratios.begin(), middle, ratios.end());
  const float gain = *middle;
  StripSum changed(grid), compared(grid);
  for (const Comparison& pixel : pixels) {
    const auto tolerance = static_cast<float>(options.min_difference) + kRelativeDifference * pixel.now;
    const bool differs =
        pixel.now < gain * pixel.lowest - tolerance || pixel.now > gain * pixel.highest + tolerance;
    const int ray = rays.polar_ray[pixel.ray];
    compared.add(ray, pixel.from_inverse, pixel.to_inverse, 1.0F);
    if (differs) {
      changed.add(ray, pixel.from_inverse, pixel.to_inverse, 1.0F);
    }
  }
  std::vector<float> fraction = changed.finish();
  const std::vector<float> all = compared.finish();
  for (size_t i = 0; i < fraction.size(); ++i) {
    fraction[i] /= all[i] + 1.0F;  // the additional pixel reduces the effect of single pixels
  }
  return fraction;
}

GroundWatch::GroundWatch(const WorkingCamera& camera, const RigidTransform& vehicle_from_camera,
                         const PolarGrid& grid, double max_distance_m, const GroundWatchOptions& options)
    : implementation_(
          std::make_unique<Implementation>(camera, vehicle_from_camera, grid, max_distance_m, options)) {}

GroundWatch::~GroundWatch() = default;

std::vector<float> GroundWatch::compare(Timestamp stamp, const cv::Mat& image, const GroundPlane& ground,
                                        const RigidTransform& fixed_from_vehicle) {
  Implementation& self = *implementation_;
  check(image.type() == CV_8UC1 && image.size() == self.size,
        "GroundWatch: expected CV_8UC1 images of the camera's size");
  if (ground.state == GroundState::kOutOfBounds) {
    return {};
  }
  while (!self.views.empty() && toSeconds(stamp - self.views.front().stamp) > kMaxInterval_s) {
    self.views.pop_front();
  }
  const RigidTransform planar =
      RigidTransform::planar(fixed_from_vehicle.translation().x(), fixed_from_vehicle.translation().y(),
                             yawOfRotation(fixed_from_vehicle.rotation()));
  self.views.push_back(self.makeView(stamp, image, planar * levelFromBody(ground)));
  const View* before = self.viewBefore(stamp);
  return before == nullptr ? std::vector<float>()
                           : self.changedFraction(self.comparePixels(self.views.back(), *before, ground));
}

void GroundWatch::clear() {
  implementation_->views.clear();
}

}  // namespace vcharge
