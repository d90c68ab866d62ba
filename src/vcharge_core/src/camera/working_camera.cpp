#include "vcharge_core/camera/working_camera.h"

#include <algorithm>
#include <cmath>

#include <opencv2/imgproc.hpp>

#include "vcharge_core/base/error.h"
#include "vcharge_core/base/options.h"

namespace vcharge {
namespace {

/// The unified model (xi and a factor on the focal lengths) whose radius g sin / (cos + xi) is closest to
/// that of a Kannala-Brandt camera over its field of view: a search over xi, with g in closed form.
MeiCamera fitUnifiedModel(const KannalaBrandtCamera& camera, double field_of_view_rad) {
  const auto& p = camera.parameters();
  const KannalaBrandtCamera unit(
      (KannalaBrandtCamera::Parameters() << 1, 1, 0, 0, p[4], p[5], p[6], p[7]).finished());
  const double max_angle = std::min(0.5 * field_of_view_rad, 0.999 * camera.maxAngle());
  constexpr int kAngles = 200;
  constexpr int kSteps = 160;
  double best_xi = 1.0, best_scale = 1.0, best_cost = std::numeric_limits<double>::infinity();
  for (int step = 0; step <= kSteps; ++step) {
    const double xi = 0.4 + 1.6 * step / kSteps;
    const double min_cos = xi > 1.0 ? -1.0 / xi : -xi;
    if (std::cos(max_angle) <= min_cos + 0.05) {
      continue;
    }
    double ab = 0.0, aa = 0.0, bb = 0.0;
    for (int i = 1; i <= kAngles; ++i) {
      const double angle = max_angle * i / kAngles;
      Eigen::Vector2d pixel;
      unit.project(Eigen::Vector3d(std::sin(angle), 0.0, std::cos(angle)), &pixel);
      const double a = std::sin(angle) / (std::cos(angle) + xi);
      ab += a * pixel.x();
      aa += a * a;
      bb += pixel.x() * pixel.x();
    }
    const double cost = bb - ab * ab / aa;
    if (cost < best_cost) {
      best_cost = cost;
      best_xi = xi;
      best_scale = ab / aa;
    }
  }
  return MeiCamera(best_xi, p[0] * best_scale, p[1] * best_scale, p[2], p[3]);
}

MeiCamera withoutDistortion(const MeiCamera& camera, double) {
  return MeiCamera(camera.xi(), camera.gamma1(), camera.gamma2(), camera.u0(), camera.v0());
}
MeiCamera withoutDistortion(const PinholeCamera& camera, double) {
  const auto p = camera.parameters();
  return MeiCamera(0.0, p[0], p[1], p[2], p[3]);
}
MeiCamera withoutDistortion(const KannalaBrandtCamera& camera, double field_of_view_rad) {
  return fitUnifiedModel(camera, field_of_view_rad);
}

MeiCamera makeWorkingModel(const CameraModel& camera, double field_of_view_rad, cv::Size image_size_px,
                           const WorkingCameraOptions& options) {
  options.validate();
  const MeiCamera unified =
      camera.visit([&](const auto& model) { return withoutDistortion(model, field_of_view_rad); });
  const double scale = options.scaleOf(image_size_px);
  const double focal_scale = scale * options.focal_scale;
  // Pixel centres have integer coordinates, so image corners lie at half pixels.
  return MeiCamera(unified.xi(), unified.gamma1() * focal_scale, unified.gamma2() * focal_scale,
                   (unified.u0() + 0.5) * scale - 0.5, (unified.v0() + 0.5) * scale - 0.5);
}

cv::Size scaledSize(cv::Size size, double scale) {
  return cv::Size(std::max(1, static_cast<int>(std::lround(size.width * scale))),
                  std::max(1, static_cast<int>(std::lround(size.height * scale))));
}

/// Bilinear sampling averages over two pixels. When samples are further apart, that many pixels are averaged
/// first to avoid aliasing: patterns that move differently from the objects that they show.
int averagedPixels(cv::Size image_size, const WorkingCameraOptions& options) {
  const double samples_per_pixel = options.scaleOf(image_size) * options.focal_scale;
  const double block_px = std::ceil(0.5 / samples_per_pixel - 1e-9);
  return static_cast<int>(std::clamp(block_px, 1.0, 1.0 * std::min(image_size.width, image_size.height)));
}

/// Mean over whole blocks of `block` x `block` pixels.
cv::Mat averageBlocks(const cv::Mat& pixels, int block) {
  const cv::Size size(pixels.cols / block, pixels.rows / block);
  cv::Mat averaged;
  cv::resize(pixels(cv::Rect(0, 0, size.width * block, size.height * block)), averaged, size, 0.0, 0.0,
             cv::INTER_AREA);
  return averaged;
}

/// Maps a sensor pixel to the coordinate in the block-averaged image, clamped to its first and last block.
float blockCoordinate(float pixel, int block, int num_blocks) {
  const float coordinate = (pixel + 0.5F) / static_cast<float>(block) - 0.5F;
  return std::clamp(coordinate, 0.0F, static_cast<float>(num_blocks - 1));
}

}  // namespace

double WorkingCameraOptions::scaleOf(cv::Size sensor_size_px) const {
  return width_px > 0 ? std::min(1.0, static_cast<double>(width_px) / sensor_size_px.width) : image_scale;
}

WorkingCamera::WorkingCamera(const CameraModel& camera, cv::Size image_size_px, double field_of_view_rad,
                             const cv::Mat& mask, const WorkingCameraOptions& options)
    : model_(makeWorkingModel(camera, field_of_view_rad, image_size_px, options)),
      size_(scaledSize(image_size_px, options.scaleOf(image_size_px))),
      sensor_size_(image_size_px),
      block_px_(averagedPixels(image_size_px, options)),
      valid_mask_(cv::Mat::zeros(size_, CV_8UC1)),
      sensor_pixels_(size_, CV_32FC2, cv::Scalar(-1.0, -1.0)) {
  check(mask.empty() || (mask.size() == image_size_px && mask.type() == CV_8UC1),
        "WorkingCamera: the mask must be CV_8UC1 of the image's size");
  // A block is valid if all of its pixels are.
  cv::Mat valid_blocks;
  if (!mask.empty()) {
    cv::compare(averageBlocks(mask != 0, block_px_), 255, valid_blocks, cv::CMP_EQ);
  }
  const double min_z = std::cos(0.5 * field_of_view_rad);
  camera.visit([&](const auto& sensor_model) {
    for (int y = 0; y < size_.height; ++y) {
      for (int x = 0; x < size_.width; ++x) {
        Eigen::Vector3d ray;
        Eigen::Vector2d pixel;
        if (!model_.unproject(Eigen::Vector2d(x, y), &ray) || ray.z() < min_z ||
            !sensor_model.project(ray, &pixel)) {
          continue;
        }
        if (pixel.x() < 0.0 || pixel.y() < 0.0 || pixel.x() > image_size_px.width - 1 ||
            pixel.y() > image_size_px.height - 1) {
          continue;
        }
        sensor_pixels_.at<cv::Vec2f>(y, x) =
            cv::Vec2f(static_cast<float>(pixel.x()), static_cast<float>(pixel.y()));
        valid_mask_.at<uint8_t>(y, x) =
            mask.empty() || isValid(valid_blocks, sensor_pixels_.at<cv::Vec2f>(y, x)) ? 255 : 0;
      }
    }
  });
  samples_ = std::make_shared<const std::vector<Sample>>(makeSamples());
}

/// Whether all blocks that bilinear sampling uses at a sensor pixel are valid.
bool WorkingCamera::isValid(const cv::Mat& valid_blocks, const cv::Vec2f& sensor_pixel) const {
  const int x = static_cast<int>(blockCoordinate(sensor_pixel[0], block_px_, valid_blocks.cols));
  const int y = static_cast<int>(blockCoordinate(sensor_pixel[1], block_px_, valid_blocks.rows));
  const int right = std::min(x + 1, valid_blocks.cols - 1);
  const int below = std::min(y + 1, valid_blocks.rows - 1);
  return valid_blocks.at<uint8_t>(y, x) != 0 && valid_blocks.at<uint8_t>(y, right) != 0 &&
         valid_blocks.at<uint8_t>(below, x) != 0 && valid_blocks.at<uint8_t>(below, right) != 0;
}

std::vector<WorkingCamera::Sample> WorkingCamera::makeSamples() const {
  std::vector<Sample> samples;
  samples.reserve(static_cast<size_t>(size_.area()));
  const cv::Size blocks(sensor_size_.width / block_px_, sensor_size_.height / block_px_);
  for (int y = 0; y < size_.height; ++y) {
    const auto* sensor = sensor_pixels_.ptr<cv::Vec2f>(y);
    for (int x = 0; x < size_.width; ++x) {
      if (sensor[x][0] < 0.0F) {
        continue;
      }
      const float u = blockCoordinate(sensor[x][0], block_px_, blocks.width);
      const float v = blockCoordinate(sensor[x][1], block_px_, blocks.height);
      const int left = std::clamp(static_cast<int>(u), 0, std::max(0, blocks.width - 2));
      const int top = std::clamp(static_cast<int>(v), 0, std::max(0, blocks.height - 2));
      samples.push_back({y * size_.width + x, top * blocks.width + left, u - static_cast<float>(left),
                         v - static_cast<float>(top)});
    }
  }
  return samples;
}

cv::Mat WorkingCamera::undistort(const cv::Mat& pixels) const {
  check(pixels.size() == sensor_size_ && pixels.type() == CV_8UC1,
        "WorkingCamera::undistort: expected CV_8UC1 of the sensor's size");
  // cv::remap rounds coordinates to 1/32 pixel, which would show up in stereo.
  cv::Mat source = block_px_ > 1 ? averageBlocks(pixels, block_px_) : pixels;
  if (!source.isContinuous()) {
    source = source.clone();
  }
  cv::Mat undistorted = cv::Mat::zeros(size_, CV_8UC1);
  const int right = source.cols > 1 ? 1 : 0, below = source.rows > 1 ? source.cols : 0;
  for (const Sample& sample : *samples_) {
    const uint8_t* top = source.data + sample.block;
    const uint8_t* bottom = top + below;
    const float upper = static_cast<float>(top[0]) + sample.right * static_cast<float>(top[right] - top[0]);
    const float lower =
        static_cast<float>(bottom[0]) + sample.right * static_cast<float>(bottom[right] - bottom[0]);
    undistorted.data[sample.pixel] =
        static_cast<uint8_t>(upper + sample.down * (lower - upper) + 0.5F);  // NOLINT: never negative
  }
  return undistorted;
}

WorkingCamera rebuildWorkingCamera(const MeiCamera& model, cv::Size size, const RigCamera& camera) {
  WorkingCameraOptions options;
  options.image_scale = static_cast<double>(size.width) / camera.image_size_px.width;
  const auto build = [&] {
    return WorkingCamera(camera.model, camera.image_size_px, camera.field_of_view_rad, camera.mask, options);
  };
  options.focal_scale = model.gamma1() / build().model().gamma1();
  WorkingCamera working = build();
  const double difference = (working.model().parameters() - model.parameters()).cwiseAbs().maxCoeff();
  if (working.size() != size || !(difference <= 1e-6)) {
    throw InputError("camera '" + camera.name + "': the range maps were made with another rig");
  }
  return working;
}

}  // namespace vcharge
