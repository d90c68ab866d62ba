#include "vcharge_obstacles/ground_watch.h"

#include <algorithm>
#include <cmath>
#include <optional>
#include <utility>

#include "ground/ground_match.h"
#include "light/ground_light.h"
#include "light/mirror_evidence.h"
#include "vcharge_core/base/error.h"

namespace vcharge {
namespace {

// Desired age of the image with which changes are found; the nearest up to the maximum is used.
constexpr double kInterval_s = 0.24;
constexpr double kMaxInterval_s = 1.0;
// Images are kept for this time.
constexpr double kMaxAge_s = 3.0;
// The body of a vehicle that has stopped pitches for this time.
constexpr double kSettled_s = 0.6;
// Nearest ground that is compared.
constexpr double kNearest_m = 0.3;
// Range up to which the ground is decided with an image at a distance.
struct Band {
  double far_m, baseline_m;
};
constexpr Band kBands[] = {{1.6, 0.2}, {2.6, 0.3}, {1000.0, 0.6}};
// Weight of a pixel that does not show the ground, relative to one that does.
constexpr float kOtherWeight = 2.0F;
// Distances of an image, relative to the desired one, with which it is used.
constexpr double kLeastBaseline = 0.6, kLargestBaseline = 1.6;
// Part of the difference that a reflection may leave unexplained, and for it to show that the ground is wet.
constexpr float kUnexplained = 0.5F, kClearlyUnexplained = 0.35F;
// Least part of the ground's pixels that clearly changed by reflections if the ground is wet. In simulated
// lots and garages it is 0.003 to 0.025 for a camera in the wet, and up to 0.0013, among movers 0.0035, when
// dry.
constexpr double kLeastMirror = 0.002;

bool isReflection(const MatchedPixel& pixel) {
  return pixel.unexplained < kUnexplained;
}

/// Pose of the tilted body over level ground.
RigidTransform levelFromBody(const GroundPlane& ground) {
  const Eigen::Vector3d normal(-ground.slope.x(), -ground.slope.y(), 1.0);
  const Eigen::Quaterniond rotation =
      Eigen::Quaterniond::FromTwoVectors(normal.normalized(), Eigen::Vector3d::UnitZ());
  return RigidTransform(rotation, Eigen::Vector3d(0.0, 0.0, -ground.offset_m / normal.norm()));
}

}  // namespace

struct GroundWatch::Implementation {
  Implementation(const WorkingCamera& camera, const RigidTransform& body_from_camera,
                 const PolarGrid& polar_grid, double furthest_m, const GroundWatchOptions& options)
      : max_distance_m(furthest_m),
        grid(polar_grid),
        vehicle_from_camera(body_from_camera),
        size(camera.size()),
        rays(camera, body_from_camera, grid),
        match(camera, body_from_camera, rays, options.min_difference),
        light(rays) {}

  void checkImage(const cv::Mat& image) const {
    check(image.type() == CV_8UC1 && image.size() == size,
          "GroundWatch: expected CV_8UC1 images of the camera's size");
  }
  /// Adds the current view and drops old ones.
  void addView(Timestamp stamp, const cv::Mat& image, const RigidTransform& fixed_from_body) {
    checkImage(image);
    while (!views.empty() && toSeconds(stamp - views.front().stamp) > kMaxAge_s) {
      views.pop_front();
    }
    views.emplace_back(stamp, image, fixed_from_body);
  }
  const GroundView* viewBefore(Timestamp stamp) const;
  const GroundView* viewAt(double baseline_m) const;
  /// Fractions of the ground pixels of each cell, by PolarGrid::index; empty if none can be compared.
  struct Fractions {
    std::vector<float> changed, same;
  };
  Fractions compareWith(const GroundView& before, const GroundMatch::Ground& ground,
                        GroundMatch::Reflections reflections);
  std::vector<float> groundPixels(const GroundMatch::Ground& ground) const;

  const double max_distance_m;
  const PolarGrid grid;
  const RigidTransform vehicle_from_camera;
  const cv::Size size;
  const PixelRays rays;
  const GroundMatch match;
  GroundLight light;
  MirrorEvidence mirror{kLeastMirror};
  std::deque<GroundView> views;  // the last one is the current one
  std::optional<Timestamp> stands_since;
  std::optional<GroundView> first_at_rest;
};

/// The view whose age is nearest to the interval; null if there is none.
const GroundView* GroundWatch::Implementation::viewBefore(Timestamp stamp) const {
  const GroundView* best = nullptr;
  for (const GroundView& view : views) {
    const double age_s = toSeconds(stamp - view.stamp);
    const bool is_better = best == nullptr || std::abs(age_s - kInterval_s) <
                                                  std::abs(toSeconds(stamp - best->stamp) - kInterval_s);
    if (age_s > 0.0 && age_s <= kMaxInterval_s && is_better) {
      best = &view;
    }
  }
  return best;
}

/// The earlier view whose distance from the current one is nearest to the baseline; null if none is near.
const GroundView* GroundWatch::Implementation::viewAt(double baseline_m) const {
  const GroundView* best = nullptr;
  double best_ratio = 0.0;
  const Eigen::Vector3d here = views.back().fixed_from_body * vehicle_from_camera.translation();
  for (const GroundView& view : views) {
    const double ratio =
        (view.fixed_from_body * vehicle_from_camera.translation() - here).norm() / baseline_m;
    if (ratio >= kLeastBaseline && ratio <= kLargestBaseline &&
        (best == nullptr || std::abs(ratio - 1.0) <= std::abs(best_ratio - 1.0))) {
      best = &view;
      best_ratio = ratio;
    }
  }
  return best;
}

GroundWatch::Implementation::Fractions GroundWatch::Implementation::compareWith(
    const GroundView& before, const GroundMatch::Ground& ground, GroundMatch::Reflections reflections) {
  const std::vector<MatchedPixel> pixels = match.compare(
      views.back(), before, ground, kNearest_m, max_distance_m, GroundMatch::Wanted::kChanges, reflections);
  if (pixels.empty()) {
    return {};
  }
  if (reflections == GroundMatch::Reflections::kSought) {
    const auto is_clear = [](const MatchedPixel& pixel) { return pixel.unexplained < kClearlyUnexplained; };
    mirror.add(pixels.size(), static_cast<size_t>(std::count_if(pixels.begin(), pixels.end(), is_clear)));
    mirror.endImage();
  }
  const bool is_mirror = mirror.isMirror();
  StripSum changed(grid), same(grid), compared(grid);
  for (const MatchedPixel& pixel : pixels) {
    const StripSum::Strip strip =
        compared.stripOf(rays.polar_ray[pixel.ray], pixel.from_inverse, pixel.to_inverse);
    compared.add(strip, 1.0F);
    if (pixel.is_changed && !(is_mirror && isReflection(pixel))) {
      changed.add(strip, 1.0F);
    } else if (pixel.keeps_texture) {
      same.add(strip, 1.0F);
    }
  }
  Fractions fractions{changed.finish(), same.finish()};
  const std::vector<float> all = compared.finish();
  for (size_t i = 0; i < all.size(); ++i) {
    fractions.changed[i] /= all[i] + 1.0F;  // the additional pixel reduces the effect of single pixels
    fractions.same[i] /= all[i] + 1.0F;
  }
  return fractions;
}

std::vector<float> GroundWatch::Implementation::groundPixels(const GroundMatch::Ground& ground) const {
  StripSum shown(grid), other(grid), compared(grid);
  const GroundMatch::Reflections reflections =
      mirror.isMirror() ? GroundMatch::Reflections::kSought : GroundMatch::Reflections::kIgnored;
  double near_m = kNearest_m;
  for (const Band& band : kBands) {
    const GroundView* before = viewAt(band.baseline_m);
    const double far_m = std::min(band.far_m, max_distance_m);
    if (before != nullptr && far_m > near_m) {
      for (const MatchedPixel& pixel : match.compare(views.back(), *before, ground, near_m, far_m,
                                                     GroundMatch::Wanted::kAll, reflections)) {
        const StripSum::Strip strip =
            compared.stripOf(rays.polar_ray[pixel.ray], pixel.from_inverse, pixel.to_inverse);
        compared.add(strip, 1.0F);
        // Whoever sees water sees the ground.
        if (pixel.is_ground || isReflection(pixel)) {
          shown.add(strip, 1.0F);
        } else if (pixel.is_other || pixel.is_changed) {
          other.add(strip, 1.0F);
        }
      }
    }
    near_m = far_m;
  }
  std::vector<float> ground_pixels = shown.finish();
  const std::vector<float> others = other.finish(), all = compared.finish();
  for (size_t i = 0; i < ground_pixels.size(); ++i) {
    // Pixels that do not decide lie between ones that do: they are ground too, but no more than those.
    const float between = std::max(0.0F, all[i] - ground_pixels[i] - others[i]);
    ground_pixels[i] += std::min(between, ground_pixels[i]);
    ground_pixels[i] = std::max(0.0F, ground_pixels[i] - kOtherWeight * others[i]);
  }
  return ground_pixels;
}

GroundWatch::GroundWatch(const WorkingCamera& camera, const RigidTransform& vehicle_from_camera,
                         const PolarGrid& grid, double max_distance_m, const GroundWatchOptions& options)
    : implementation_(std::make_unique<Implementation>(camera, vehicle_from_camera, grid, max_distance_m,
                                                       (options.validate(), options))) {}

GroundWatch::~GroundWatch() = default;

GroundAppearance GroundWatch::compare(Timestamp stamp, const cv::Mat& image, const GroundPlane& ground,
                                      const RigidTransform& fixed_from_vehicle) {
  Implementation& self = *implementation_;
  self.checkImage(image);
  if (ground.state == GroundState::kOutOfBounds) {
    return {};
  }
  const RigidTransform planar =
      RigidTransform::planar(fixed_from_vehicle.translation().x(), fixed_from_vehicle.translation().y(),
                             yawOfRotation(fixed_from_vehicle.rotation()));
  self.addView(stamp, self.light.even(image, planar), planar * levelFromBody(ground));
  const GroundMatch::Ground rays_to_ground = self.match.meet(ground);
  GroundAppearance appearance;
  if (const GroundView* before = self.viewBefore(stamp)) {
    appearance.changed_fraction =
        self.compareWith(*before, rays_to_ground, GroundMatch::Reflections::kSought).changed;
  }
  if (ground.state == GroundState::kMeasured) {
    appearance.ground_pixels = self.groundPixels(rays_to_ground);
  }
  return appearance;
}

StandingAppearance GroundWatch::compareStanding(Timestamp stamp, const cv::Mat& image) {
  Implementation& self = *implementation_;
  self.addView(stamp, image, RigidTransform());
  const GroundMatch::Ground level = self.match.meet(GroundPlane());
  StandingAppearance appearance;
  const auto addChanges = [&](const std::vector<float>& changed) {
    appearance.changed_fraction.resize(changed.empty() ? appearance.changed_fraction.size() : changed.size());
    for (size_t i = 0; i < changed.size(); ++i) {
      appearance.changed_fraction[i] = std::max(appearance.changed_fraction[i], changed[i]);
    }
  };
  const GroundView* before = self.viewBefore(stamp);
  if (before != nullptr) {
    addChanges(self.compareWith(*before, level, GroundMatch::Reflections::kIgnored).changed);
    if (before != &self.views.front()) {
      addChanges(self.compareWith(self.views.front(), level, GroundMatch::Reflections::kIgnored).changed);
    }
  }
  if (self.first_at_rest) {
    appearance.first = self.first_at_rest->stamp;
    Implementation::Fractions fractions =
        self.compareWith(*self.first_at_rest, level, GroundMatch::Reflections::kIgnored);
    addChanges(fractions.changed);
    appearance.same_fraction = std::move(fractions.same);
  } else if (!self.stands_since) {
    self.stands_since = stamp;
  } else if (toSeconds(stamp - *self.stands_since) >= kSettled_s) {
    self.first_at_rest = self.views.back();
  }
  return appearance;
}

void GroundWatch::clear() {
  implementation_->views.clear();
  implementation_->light.clear();
  implementation_->stands_since.reset();
  implementation_->first_at_rest.reset();
}

}  // namespace vcharge
