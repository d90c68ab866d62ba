#include "vcharge_simulation/sensors/lens_glare.h"

#include <algorithm>
#include <cmath>
#include <utility>

namespace vcharge {

namespace {

constexpr double kFullWidth_px = 1280.0;
// Lengths are for images that are 1280 wide; light is relative to white in the sun.
constexpr double kSunLight = 25.0;      // light at the centre of the sun
constexpr double kSunRadius_px = 40.0;  // radius at which the light is half as strong
constexpr double kLampRadius_px = 2.0;  // a lamp is much smaller than the sun's aureole
// Ghosts lie on the line through the sun and the middle of the image.
constexpr double kGhostPositions[] = {0.55, -0.3, -0.75};
constexpr double kGhostRadii_px[] = {14.0, 34.0, 22.0};
constexpr double kGhostLight = 0.05;

// A disk with a soft edge: an image of the aperture.
void addGhost(const Eigen::Vector2d& centre_px, double radius_px, double peak, cv::Mat* light) {
  const auto reach = static_cast<int>(std::ceil(1.2 * radius_px));
  const cv::Rect inside = cv::Rect(static_cast<int>(centre_px.x()) - reach,
                                   static_cast<int>(centre_px.y()) - reach, 2 * reach + 1, 2 * reach + 1) &
                          cv::Rect(0, 0, light->cols, light->rows);
  for (int y = inside.y; y < inside.y + inside.height; ++y) {
    for (int x = inside.x; x < inside.x + inside.width; ++x) {
      const double distance = (Eigen::Vector2d(x, y) - centre_px).norm() / radius_px;
      light->at<float>(y, x) += static_cast<float>(peak * std::clamp((1.2 - distance) / 0.4, 0.0, 1.0));
    }
  }
}

}  // namespace

void addGlare(const Eigen::Vector2d& centre_px, double peak, double radius_px, cv::Mat* light) {
  for (int y = 0; y < light->rows; ++y) {
    auto* row = light->ptr<float>(y);
    for (int x = 0; x < light->cols; ++x) {
      const double squared = (Eigen::Vector2d(x, y) - centre_px).squaredNorm() / (radius_px * radius_px);
      row[x] += static_cast<float>(peak / (1.0 + squared));
    }
  }
}

void addSunGlare(const Eigen::Vector2d& centre_px, double illuminance_lx, double scatter, cv::Mat* light) {
  addGlare(centre_px, kSunLight * scatter * illuminance_lx / kSunIlluminance_lx,
           kSunRadius_px * light->cols / kFullWidth_px, light);
}

void addLampGlare(const Eigen::Vector2d& centre_px, double illuminance_lx, double scatter, cv::Mat* light) {
  // Far from the centre the light is that of the sun, in proportion to the illuminance.
  const double widening = kSunRadius_px / kLampRadius_px;
  const double peak = kSunLight * widening * widening * illuminance_lx / kSunIlluminance_lx;
  addGlare(centre_px, scatter * peak, kLampRadius_px * light->cols / kFullWidth_px, light);
}

std::optional<SeenPoint> findPoint(const CameraView& view, const Readout& readout,
                                   const Eigen::Vector4d& point) {
  const double rows = view.size().height;
  // The row in which the point appears depends on the time of that row.
  SeenPoint seen{{0.0, 0.5 * (rows - 1.0)}, Eigen::Vector3d::Zero()};
  for (int step = 0; step < 3; ++step) {
    const double row = std::clamp(seen.pixel.y(), 0.0, rows - 1.0);
    const RigidTransform world_from_camera =
        readout.motion.at(readout.timeOfRow(row, view.size().height)) * *view.camera().vehicle_from_camera;
    seen.camera_m = world_from_camera.translation();
    const Eigen::Vector3d in_camera = world_from_camera.rotation().inverse() *
                                      (point.head<3>() - point.w() * world_from_camera.translation());
    if (!view.camera().model.project(in_camera, &seen.pixel)) {
      return std::nullopt;
    }
  }
  const auto x = static_cast<int>(std::lround(seen.pixel.x()));
  const auto y = static_cast<int>(std::lround(seen.pixel.y()));
  if (x < 0 || y < 0 || x >= view.size().width || y >= view.size().height || view.centreRay(x, y).isZero() ||
      view.mask().at<uint8_t>(y, x) == 0) {
    return std::nullopt;
  }
  return seen;
}

LensGlare::LensGlare(const Scene& scene, IsVisible is_visible)
    : scene_(scene), is_visible_(std::move(is_visible)) {}

void LensGlare::apply(const CameraView& view, const Readout& readout, cv::Mat* light) const {
  const auto find = [&](const Eigen::Vector4d& point) {
    std::optional<SeenPoint> seen = findPoint(view, readout, point);
    return seen && is_visible_(seen->camera_m, point) ? seen : std::nullopt;
  };
  const double sun = scene_.sky->light().sun_irradiance;
  if (sun > 0.0) {
    const Eigen::Vector3d towards = scene_.sky->directionToSun().cast<double>();
    if (const auto seen = find({towards.x(), towards.y(), towards.z(), 0.0})) {
      const double scale = light->cols / kFullWidth_px;
      addSunGlare(seen->pixel, sun * kSunIlluminance_lx, kCleanScatter, light);
      const Eigen::Vector2d middle(0.5 * (light->cols - 1), 0.5 * (light->rows - 1));
      for (size_t i = 0; i < std::size(kGhostPositions); ++i) {
        addGhost(middle + kGhostPositions[i] * (seen->pixel - middle), scale * kGhostRadii_px[i],
                 kGhostLight * sun, light);
      }
    }
  }
  for (const Lamp& lamp : scene_.lamps) {
    const Eigen::Vector3d centre = lamp.centre.cast<double>();
    if (const auto seen = find({centre.x(), centre.y(), centre.z(), 1.0})) {
      const Eigen::Vector3f to_lamp = lamp.centre - seen->camera_m.cast<float>();
      addLampGlare(seen->pixel, kSunIlluminance_lx * lampIrradiance(lamp, to_lamp, to_lamp.normalized()),
                   kCleanScatter, light);
    }
  }
}

}  // namespace vcharge
