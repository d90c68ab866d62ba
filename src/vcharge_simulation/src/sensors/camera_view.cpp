#include "vcharge_simulation/sensors/camera_view.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <utility>

#include <tbb/parallel_for.h>
#include <opencv2/imgproc.hpp>

#include "rendering/ray_tracer.h"
#include "vcharge_core/base/error.h"

namespace vcharge {

namespace {

// Rotated grid: four samples in four different rows and columns of the pixel.
constexpr std::array<std::array<double, 2>, 4> kSampleOffsets = {
    {{-0.125, -0.375}, {0.375, -0.125}, {-0.375, 0.125}, {0.125, 0.375}}};
// Width of the fading rim of the image circle.
constexpr double kRimFade_rad = 0.045;
constexpr double kFullWidth_px = 1280.0;
// The lens blurs the own car beyond its outline.
constexpr int kMaskMargin_px = 2;
// A body close to the lens is out of focus within this distance of its outline.
constexpr int kOutlineWidth_px = 4;

float lensTransmission(double cos_angle, double angle_rad, double half_field_of_view_rad) {
  const double natural = 0.55 + 0.45 * std::max(0.0, cos_angle);
  const double rim = std::clamp((half_field_of_view_rad - angle_rad) / kRimFade_rad, 0.0, 1.0);
  return static_cast<float>(natural * rim * rim * (3.0 - 2.0 * rim));
}

}  // namespace

CameraView::CameraView(const RigCamera& camera, std::shared_ptr<const VehicleBody> body,
                       const LensOptions& lens)
    : camera_(camera),
      lens_(lens),
      body_(std::move(body)),
      blocks_per_row_((camera.image_size_px.width + 1) / 2),
      block_rows_((camera.image_size_px.height + 1) / 2) {
  check(camera.vehicle_from_camera.has_value(), "CameraView: the camera has no vehicle_from_camera");
  lens.validate();
  const size_t num_blocks = static_cast<size_t>(blocks_per_row_) * static_cast<size_t>(block_rows_);
  const size_t num_pixels = static_cast<size_t>(size().area());
  sample_rays_.assign(num_blocks * 3 * kSamplesPerBlock, 0.0F);
  block_pixels_.assign(num_blocks, 0);
  block_body_mask_.assign(num_blocks, 0);
  block_body_start_.assign(num_blocks, 0);
  centre_rays_.assign(num_pixels, Eigen::Vector3f::Zero());
  pixel_angle_rad_.assign(num_pixels, 0.0F);
  vignette_ = cv::Mat::zeros(size(), CV_32FC1);
  mask_ = cv::Mat(size(), CV_8UC1, cv::Scalar(255));
  cv::Mat sigma_px = cv::Mat::zeros(size(), CV_32FC1);
  computeRays(&sigma_px);
  computePixelAngles();
  if (body_ != nullptr) {
    findBody();
    if (body_->isGlossy()) {
      blurOutline(&sigma_px);
    }
  }
  blur_ = LensBlur(sigma_px);
}

void CameraView::blurOutline(cv::Mat* sigma_px) const {
  cv::Mat outline;
  const cv::Mat around = cv::Mat::ones(2 * kOutlineWidth_px + 1, 2 * kOutlineWidth_px + 1, CV_8UC1);
  cv::morphologyEx(mask_, outline, cv::MORPH_GRADIENT, around);
  sigma_px->setTo(LensBlur::kMaxSigma_px * size().width / kFullWidth_px, outline);
}

void CameraView::computeRays(cv::Mat* sigma_px) {
  const double image_scale = size().width / kFullWidth_px;
  const double half_field_of_view_rad = 0.5 * camera_.field_of_view_rad;
  tbb::parallel_for(0, block_rows_, [&](int block_y) {
    for (int block_x = 0; block_x < blocks_per_row_; ++block_x) {
      const size_t block = static_cast<size_t>(block_y) * blocks_per_row_ + block_x;
      float* rays = &sample_rays_[block * 3 * kSamplesPerBlock];
      for (int p = 0; p < 4; ++p) {
        const int x = 2 * block_x + p % 2;
        const int y = 2 * block_y + p / 2;
        Eigen::Vector3d centre;
        if (x >= size().width || y >= size().height ||
            !camera_.model.unproject(Eigen::Vector2d(x, y), &centre)) {
          continue;
        }
        const double angle_rad = std::acos(std::clamp(centre.z(), -1.0, 1.0));
        if (angle_rad > half_field_of_view_rad) {
          continue;
        }
        bool complete = true;
        for (int s = 0; s < kSamplesPerPixel; ++s) {
          Eigen::Vector3d ray;
          const Eigen::Vector2d pixel(x + kSampleOffsets[static_cast<size_t>(s)][0],
                                      y + kSampleOffsets[static_cast<size_t>(s)][1]);
          complete = complete && camera_.model.unproject(pixel, &ray);
          if (complete) {
            rays[4 * p + s] = static_cast<float>(ray.x());
            rays[kSamplesPerBlock + 4 * p + s] = static_cast<float>(ray.y());
            rays[2 * kSamplesPerBlock + 4 * p + s] = static_cast<float>(ray.z());
          }
        }
        if (complete) {
          block_pixels_[block] |= static_cast<uint8_t>(1 << p);
          centre_rays_[static_cast<size_t>(y) * size().width + x] = centre.cast<float>();
          sigma_px->at<float>(y, x) = static_cast<float>(lens_.blurAt(angle_rad, image_scale));
          vignette_.at<float>(y, x) = lensTransmission(centre.z(), angle_rad, half_field_of_view_rad);
        }
      }
    }
  });
}

void CameraView::computePixelAngles() {
  for (int y = 0; y < size().height; ++y) {
    for (int x = 0; x < size().width; ++x) {
      const Eigen::Vector3f ray = centreRay(x, y);
      if (ray.isZero()) {
        continue;
      }
      // Towards the image centre, where a neighbour always exists.
      const Eigen::Vector3f beside = centreRay(x + (x < size().width / 2 ? 1 : -1), y);
      const Eigen::Vector3f below = centreRay(x, y + (y < size().height / 2 ? 1 : -1));
      pixel_angle_rad_[static_cast<size_t>(y) * size().width + x] =
          std::sqrt(ray.cross(beside).norm() * ray.cross(below).norm());
    }
  }
}

void CameraView::findBody() {
  const RigidTransform& vehicle_from_camera = *camera_.vehicle_from_camera;
  const Eigen::Matrix3f rotation = vehicle_from_camera.rotationMatrix().cast<float>();
  const Eigen::Vector3f origin = vehicle_from_camera.translation().cast<float>();
  std::vector<std::vector<BodySample>> samples_of_row(static_cast<size_t>(block_rows_));
  tbb::parallel_for(0, block_rows_, [&](int block_y) {
    for (int block_x = 0; block_x < blocks_per_row_; ++block_x) {
      const size_t block = static_cast<size_t>(block_y) * blocks_per_row_ + block_x;
      const float* rays = blockRays(block);
      for (int i = 0; i < kSamplesPerBlock; ++i) {
        if ((blockPixels(block) >> (i / kSamplesPerPixel) & 1) == 0) {
          continue;
        }
        const Eigen::Vector3f ray =
            rotation * Eigen::Vector3f(rays[i], rays[kSamplesPerBlock + i], rays[2 * kSamplesPerBlock + i]);
        RayTracer::Hit hit;
        if (!body_->tracer().cast(origin, ray, &hit)) {
          continue;
        }
        const Eigen::Vector3f normal = hit.normal(body_->mesh());
        block_body_mask_[block] |= static_cast<uint16_t>(1U << i);
        samples_of_row[static_cast<size_t>(block_y)].push_back(
            {origin + hit.distance_m * ray, normal.dot(ray) > 0.0F ? Eigen::Vector3f(-normal) : normal,
             body_->mesh().triangles[hit.triangle].material});
        mask_.at<uint8_t>(2 * block_y + i / 8, 2 * block_x + i / 4 % 2) = 0;
      }
    }
  });
  for (int block_y = 0; block_y < block_rows_; ++block_y) {
    size_t next = body_samples_.size();
    for (int block_x = 0; block_x < blocks_per_row_; ++block_x) {
      const size_t block = static_cast<size_t>(block_y) * blocks_per_row_ + block_x;
      block_body_start_[block] = next;
      next += static_cast<size_t>(__builtin_popcount(block_body_mask_[block]));
    }
    const std::vector<BodySample>& row = samples_of_row[static_cast<size_t>(block_y)];
    body_samples_.insert(body_samples_.end(), row.begin(), row.end());
  }
  cv::erode(mask_, mask_, cv::Mat::ones(2 * kMaskMargin_px + 1, 2 * kMaskMargin_px + 1, CV_8UC1),
            cv::Point(-1, -1), 1, cv::BORDER_REPLICATE);
}

}  // namespace vcharge
