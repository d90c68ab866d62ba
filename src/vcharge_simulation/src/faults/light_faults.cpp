#include "vcharge_simulation/faults/light_faults.h"

#include <algorithm>
#include <cmath>
#include <utility>

#include <opencv2/imgproc.hpp>

#include "vcharge_simulation/rendering/noise.h"
#include "vcharge_simulation/sensors/lens_glare.h"

namespace vcharge {

namespace {

constexpr double kFullWidth_px = 1280.0;
// Lengths are for images that are 1280 wide; light is relative to white in the sun.
constexpr double kScatter = 1.0;  // the lens is not clean
constexpr double kMaxBlobRadius_px = 45.0;
constexpr double kMaxBlobLight = 0.15;
constexpr double kBlobTransmission = 0.35;  // transmission at the centre of a blob
constexpr double kLineLight = 0.5;
constexpr double kLineHalfWidth_px = 2.5;
// Thinner lines would fall between the pixels of scaled-down images.
constexpr double kMinLineHalfWidth_px = 0.6;
// A drop shows a field three times as wide as itself, out of focus, with an edge as soft.
constexpr int kDropReduction = 3;
constexpr double kDropBlur = 0.08;  // standard deviation, relative to the drop's radius
constexpr double kDropEdge = 0.3;   // width of the edge, relative to the drop's radius

template <class Function>
cv::Mat mapOfPixels(cv::Size size, Function&& value) {
  cv::Mat map(size, CV_32FC1);
  for (int y = 0; y < size.height; ++y) {
    for (int x = 0; x < size.width; ++x) {
      map.at<float>(y, x) = static_cast<float>(value(Eigen::Vector2d(x, y)));
    }
  }
  return map;
}

Eigen::Vector2d pixelAt(double x, double y, cv::Size size) {
  return {x * size.width - 0.5, y * size.height - 0.5};
}

cv::Mat vignetteOf(const VignettingFault& fault, const CameraView& view) {
  const double rim_tangent = std::sqrt(std::pow(1.0 - fault.rim_loss, -0.5) - 1.0);
  const double rim_rad = 0.5 * view.camera().field_of_view_rad;
  return mapOfPixels(view.size(), [&](const Eigen::Vector2d& pixel) {
    const Eigen::Vector3f ray = view.centreRay(static_cast<int>(pixel.x()), static_cast<int>(pixel.y()));
    const double angle_rad = ray.isZero() ? rim_rad : std::acos(std::clamp<double>(ray.z(), -1.0, 1.0));
    const double tangent = rim_tangent * angle_rad / rim_rad;
    const double squared_cosine = 1.0 / (1.0 + tangent * tangent);
    return squared_cosine * squared_cosine;
  });
}

void showThroughDrop(const WaterDropFault& drop, cv::Mat* light) {
  const Eigen::Vector2d centre = pixelAt(drop.x, drop.y, light->size());
  const double radius_px = drop.radius * light->cols;
  cv::Mat reduced;
  cv::resize(*light, reduced,
             (light->size() + cv::Size(kDropReduction - 1, kDropReduction - 1)) / kDropReduction, 0, 0,
             cv::INTER_AREA);
  cv::GaussianBlur(reduced, reduced, cv::Size(), kDropBlur * radius_px, 0.0, cv::BORDER_REPLICATE);
  const Eigen::Array2d scale(static_cast<double>(reduced.cols) / light->cols,
                             static_cast<double>(reduced.rows) / light->rows);
  const cv::Rect inside =
      cv::Rect(cv::Point(static_cast<int>(centre.x() - radius_px), static_cast<int>(centre.y() - radius_px)),
               cv::Point(static_cast<int>(centre.x() + radius_px) + 2,
                         static_cast<int>(centre.y() + radius_px) + 2)) &
      cv::Rect({0, 0}, light->size());
  cv::Mat source(inside.size(), CV_32FC2);
  for (int y = 0; y < inside.height; ++y) {
    for (int x = 0; x < inside.width; ++x) {
      const Eigen::Vector2d offset = Eigen::Vector2d(inside.x + x, inside.y + y) - centre;
      const Eigen::Array2d shown = ((centre - kDropReduction * offset).array() + 0.5) * scale - 0.5;
      source.at<cv::Vec2f>(y, x) = cv::Vec2f(static_cast<float>(shown.x()), static_cast<float>(shown.y()));
    }
  }
  cv::Mat refracted;
  cv::remap(reduced, refracted, source, cv::noArray(), cv::INTER_LINEAR, cv::BORDER_REPLICATE);
  for (int y = 0; y < inside.height; ++y) {
    for (int x = 0; x < inside.width; ++x) {
      const double distance = (Eigen::Vector2d(inside.x + x, inside.y + y) - centre).norm() / radius_px;
      const double edge = std::clamp((1.0 - distance) / kDropEdge, 0.0, 1.0);
      const auto weight = static_cast<float>(edge * edge * (3.0 - 2.0 * edge));
      float& pixel = light->at<float>(inside.y + y, inside.x + x);
      pixel += weight * (refracted.at<float>(y, x) - pixel);
    }
  }
}

struct Blob {
  Eigen::Vector2d centre_px;
  double radius_px, light;

  // 1 at the centre with a soft edge, because dirt on the lens is far out of focus.
  double weight(const Eigen::Vector2d& pixel) const {
    const double squared = (pixel - centre_px).squaredNorm() / (radius_px * radius_px);
    return std::exp(-squared * squared);
  }
};

void makeDirt(const DirtyLensFault& fault, int index, cv::Size size, cv::Mat* transmission, cv::Mat* blur,
              cv::Mat* light) {
  const double scale = size.width / kFullWidth_px;
  Random random(static_cast<uint64_t>(fault.seed) * 1024U + static_cast<uint64_t>(index));
  std::vector<Blob> blobs(static_cast<size_t>(fault.blobs));
  for (Blob& blob : blobs) {
    blob.centre_px.x() = random.uniform(0.0, size.width);
    blob.centre_px.y() = random.uniform(0.0, size.height);
    blob.radius_px = scale * kMaxBlobRadius_px * random.uniform(0.3, 1.0);
    blob.light = random.uniform(0.0, kMaxBlobLight);
  }
  const double left_y = size.height * random.uniform(0.2, 0.8);
  const double right_y = size.height * random.uniform(0.2, 0.8);
  const Eigen::Vector2d along = Eigen::Vector2d(size.width, right_y - left_y).normalized();
  const double half_width_px = std::max(kMinLineHalfWidth_px, scale * kLineHalfWidth_px);
  *transmission = mapOfPixels(size, [&](const Eigen::Vector2d& pixel) {
    double passed = 1.0;
    for (const Blob& blob : blobs) {
      passed *= 1.0 - (1.0 - kBlobTransmission) * blob.weight(pixel);
    }
    return passed;
  });
  *blur = mapOfPixels(size, [&](const Eigen::Vector2d& pixel) {
    double sharp = 1.0;
    for (const Blob& blob : blobs) {
      sharp *= 1.0 - blob.weight(pixel);
    }
    return 1.0 - sharp;
  });
  *light = mapOfPixels(size, [&](const Eigen::Vector2d& pixel) {
    const double across = (along.x() * (pixel.y() - left_y) - along.y() * pixel.x()) / half_width_px;
    double sum = kLineLight * std::exp(-0.5 * across * across);
    for (const Blob& blob : blobs) {
      sum += blob.light * blob.weight(pixel);
    }
    return sum;
  });
}

}  // namespace

LightFaults::LightFaults(const FaultOptions& faults, const RecordedCameras& cameras,
                         const CameraResponse& response, Timestamp start, IsVisible is_visible)
    : faults_(faults),
      cameras_(cameras),
      response_(response),
      start_(start),
      is_visible_(std::move(is_visible)),
      lenses_(cameras.size()) {
  faults.validate();
  for (size_t i = 0; i < cameras.size(); ++i) {
    const std::string& name = cameras.name(i);
    const cv::Size size = cameras.rig().cameras[i].image_size_px;
    Lens& lens = lenses_[i];
    if (faults.vignetting.actsOn(name)) {
      lens.vignette = vignetteOf(faults.vignetting, cameras.view(i, Duration(0)));
    }
    if (faults.sun_glare.actsOn(name)) {
      lens.sun = cv::Mat::zeros(size, CV_32FC1);
      addSunGlare(pixelAt(faults.sun_glare.x, faults.sun_glare.y, size), kSunIlluminance_lx, kScatter,
                  &lens.sun);
    }
    if (faults.dirty_lens.actsOn(name)) {
      makeDirt(faults.dirty_lens, cameras.index(i), size, &lens.dirt_transmission, &lens.dirt_blur,
               &lens.dirt_light);
    }
  }
}

cv::Mat LightFaults::apply(size_t camera, Timestamp stamp, const cv::Mat& clean,
                           const Readout& readout) const {
  const std::string& name = cameras_.name(camera);
  const Duration since_start = stamp - start_;
  const auto acts = [&](const CameraFault& fault) { return fault.actsOn(name, since_start); };
  const bool is_dark = faults_.low_light.isActive() && faults_.low_light.actsAt(since_start);
  if (!is_dark && !acts(faults_.vignetting) && !acts(faults_.water_drop) && !acts(faults_.dirty_lens) &&
      !acts(faults_.sun_glare) && !acts(faults_.bright_lamps)) {
    return clean;
  }
  const Lens& lens = lenses_[camera];
  cv::Mat light;
  if (clean.type() == CV_32FC1) {
    light = clean.clone();
  } else {
    cv::Mat light_of_gray(1, 256, CV_32FC1);
    for (int gray = 0; gray < 256; ++gray) {
      light_of_gray.at<float>(gray) = static_cast<float>(response_.lightFromGray(gray));
    }
    cv::LUT(clean, light_of_gray, light);
  }
  if (acts(faults_.vignetting)) {
    light = light.mul(lens.vignette);
  }
  if (acts(faults_.water_drop)) {
    showThroughDrop(faults_.water_drop, &light);
  }
  if (acts(faults_.dirty_lens)) {
    const double sigma_px = faults_.dirty_lens.blur_px * light.cols / kFullWidth_px;
    if (sigma_px > 0.0) {
      cv::Mat blurred;
      cv::GaussianBlur(light, blurred, cv::Size(), sigma_px, 0.0, cv::BORDER_REPLICATE);
      light += lens.dirt_blur.mul(blurred - light);
    }
    light = light.mul(lens.dirt_transmission) + lens.dirt_light;
  }
  if (is_dark) {
    light *= faults_.low_light.level;
  }
  if (acts(faults_.sun_glare)) {
    light += lens.sun;
  }
  if (acts(faults_.bright_lamps)) {
    addLamps(cameras_.view(camera, since_start), readout, &light);
  }
  return light;
}

void LightFaults::addLamps(const CameraView& view, const Readout& readout, cv::Mat* light) const {
  const BrightLampsFault& lamps = faults_.bright_lamps;
  for (size_t i = 0; i < lamps.image_positions.size(); i += 2) {
    addLampGlare(pixelAt(lamps.image_positions[i], lamps.image_positions[i + 1], light->size()),
                 lamps.intensity_cd / (lamps.image_distance_m * lamps.image_distance_m), kScatter, light);
  }
  for (size_t i = 0; i < lamps.positions_m.size(); i += 3) {
    const Eigen::Vector3d lamp_m(lamps.positions_m.data() + i);
    const auto seen = findPoint(view, readout, lamp_m.homogeneous());
    if (seen && (!is_visible_ || is_visible_(seen->camera_m, lamp_m))) {
      addLampGlare(seen->pixel, lamps.intensity_cd / std::max(0.01, (lamp_m - seen->camera_m).squaredNorm()),
                   kScatter, light);
    }
  }
}

}  // namespace vcharge
