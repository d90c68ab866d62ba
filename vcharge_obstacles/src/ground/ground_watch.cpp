#include "vcharge_obstacles/ground_watch.h"

#include <algorithm>
#include <cmath>

#include <opencv2/imgproc.hpp>

#include "detection/pixel_rays.h"
#include "vcharge_core/base/error.h"
#include "vcharge_core/frames/bilinear_sample.h"

namespace vcharge {
namespace {

// Windows of the image: noise is smoothed over so many pixels before the comparison.
constexpr int kSmoothing_px = 3;
// With fewer pixels to compare the brightness of the two images is not known.
constexpr size_t kMinCompared = 200;
constexpr float kMinBrightness = 8.0F;

/// An image as later ones are compared with it.
struct View {
  Timestamp stamp;
  RigidTransform fixed_from_body;
  cv::Mat smooth, lowest, highest;  // over the slack
};

/// The body stands tilted over the level ground.
RigidTransform levelFromBody(const GroundPlane& ground) {
  const Eigen::Vector3d normal(-ground.slope.x(), -ground.slope.y(), 1.0);
  const Eigen::Quaterniond rotation =
      Eigen::Quaterniond::FromTwoVectors(normal.normalized(), Eigen::Vector3d::UnitZ());
  return RigidTransform(rotation, Eigen::Vector3d(0.0, 0.0, -ground.offset_m / normal.norm()));
}

/// What a pixel shows now, and what it would show if it were the ground that was seen before.
struct Comparison {
  size_t ray;
  float from_inverse, to_inverse;  // the strip of ground that the pixel speaks for
  float now, before, lowest, highest;
};

}  // namespace

void GroundWatchOptions::validate() const {
  requireField(interval_s > 0.0, "interval_s", "must be positive", interval_s);
  requireField(max_interval_s > interval_s, "max_interval_s", "must be above interval_s", max_interval_s);
  requireField(max_distance_m > 0.0, "max_distance_m", "must be positive", max_distance_m);
  requireField(min_difference > 0.0, "min_difference", "must be positive", min_difference);
  requireField(relative_difference >= 0.0, "relative_difference", "must not be negative",
               relative_difference);
  requireField(slack_px >= 0 && slack_px <= 5, "slack_px", "must be in [0, 5]", slack_px);
}

struct GroundWatch::Implementation {
  Implementation(const WorkingCamera& camera, const RigidTransform& body_from_camera,
                 const PolarGrid& polar_grid, const GroundWatchOptions& watch_options)
      : options((watch_options.validate(), watch_options)),
        grid(polar_grid),
        model(camera.model()),
        vehicle_from_camera(body_from_camera),
        size(camera.size()),
        rays(camera, body_from_camera, grid, 1) {
    // Neither smoothing nor slack may reach beyond what the camera sees.
    const int reach = 2 * (kSmoothing_px / 2 + options.slack_px) + 3;
    cv::erode(camera.validMask(), valid, cv::Mat::ones(reach, reach, CV_8U), cv::Point(-1, -1), 1,
              cv::BORDER_CONSTANT, cv::Scalar(0));
  }

  View makeView(Timestamp stamp, const cv::Mat& image, const RigidTransform& fixed_from_body) const {
    View view{stamp, fixed_from_body, {}, {}, {}};
    cv::blur(image, view.smooth, cv::Size(kSmoothing_px, kSmoothing_px));
    const int side = 2 * options.slack_px + 1;
    const cv::Mat window = cv::Mat::ones(side, side, CV_8U);
    cv::erode(view.smooth, view.lowest, window);
    cv::dilate(view.smooth, view.highest, window);
    return view;
  }
  const View* viewBefore(Timestamp stamp) const;
  std::vector<Comparison> comparePixels(const View& now, const View& before, const GroundPlane& ground) const;
  std::vector<float> changedShare(const std::vector<Comparison>& pixels) const;

  const GroundWatchOptions options;
  const PolarGrid grid;
  const MeiCamera model;
  const RigidTransform vehicle_from_camera;
  const cv::Size size;
  const PixelRays rays;
  cv::Mat valid;
  std::deque<View> views;
};

/// The one whose age is nearest to the interval.
const View* GroundWatch::Implementation::viewBefore(Timestamp stamp) const {
  const View* best = nullptr;
  for (const View& view : views) {
    const double age_s = toSeconds(stamp - view.stamp);
    const bool is_better =
        best == nullptr ||
        std::abs(age_s - options.interval_s) < std::abs(toSeconds(stamp - best->stamp) - options.interval_s);
    if (age_s > 0.0 && age_s <= options.max_interval_s && is_better) {
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
  const auto max_distance = static_cast<float>(options.max_distance_m);
  // Ground is seen up to here, and hides what is lower: as a pixel's ground is judged by the detector.
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

std::vector<float> GroundWatch::Implementation::changedShare(const std::vector<Comparison>& pixels) const {
  // Exposure follows the light: most of the ground is what it was.
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
    const auto tolerance = static_cast<float>(options.min_difference) +
                           static_cast<float>(options.relative_difference) * pixel.now;
    const bool differs =
        pixel.now < gain * pixel.lowest - tolerance || pixel.now > gain * pixel.highest + tolerance;
    const int ray = rays.polar_ray[pixel.ray];
    compared.add(ray, pixel.from_inverse, pixel.to_inverse, 1.0F);
    if (differs) {
      changed.add(ray, pixel.from_inverse, pixel.to_inverse, 1.0F);
    }
  }
  std::vector<float> share = changed.finish();
  const std::vector<float> all = compared.finish();
  for (size_t i = 0; i < share.size(); ++i) {
    share[i] /= all[i] + 1.0F;  // one more: a single pixel says little
  }
  return share;
}

GroundWatch::GroundWatch(const WorkingCamera& camera, const RigidTransform& vehicle_from_camera,
                         const PolarGrid& grid, const GroundWatchOptions& options)
    : implementation_(std::make_unique<Implementation>(camera, vehicle_from_camera, grid, options)) {}

GroundWatch::~GroundWatch() = default;

std::vector<float> GroundWatch::compare(Timestamp stamp, const cv::Mat& image, const GroundPlane& ground,
                                        const RigidTransform& fixed_from_vehicle) {
  Implementation& self = *implementation_;
  check(image.type() == CV_8UC1 && image.size() == self.size,
        "GroundWatch: expected CV_8UC1 images of the camera's size");
  if (ground.state == GroundState::kOutOfBounds) {
    return {};
  }
  while (!self.views.empty() && toSeconds(stamp - self.views.front().stamp) > self.options.max_interval_s) {
    self.views.pop_front();
  }
  const RigidTransform planar =
      RigidTransform::planar(fixed_from_vehicle.translation().x(), fixed_from_vehicle.translation().y(),
                             yawOfRotation(fixed_from_vehicle.rotation()));
  self.views.push_back(self.makeView(stamp, image, planar * levelFromBody(ground)));
  const View* before = self.viewBefore(stamp);
  return before == nullptr ? std::vector<float>()
                           : self.changedShare(self.comparePixels(self.views.back(), *before, ground));
}

void GroundWatch::clear() {
  implementation_->views.clear();
}

}  // namespace vcharge
