#pragma once

#include <cstdint>
#include <memory>
#include <vector>

#include <opencv2/core.hpp>

#include "vcharge_core/camera/camera_rig.h"
#include "vcharge_simulation/sensors/lens_blur.h"
#include "vcharge_simulation/vehicle/vehicle_body.h"

namespace vcharge {

/// Everything about one camera that does not change from frame to frame: the rays of the four samples of
/// every pixel, the samples that meet the own car, vignette and lens blur. Immutable, thread safe.
///
/// Pixels are grouped in blocks of 2x2. Sample 4 * p + s of a block is sample s, on a rotated grid, of pixel
/// p (row-major).
class CameraView {
 public:
  static constexpr int kSamplesPerPixel = 4;
  static constexpr int kSamplesPerBlock = 16;

  /// Point on the surface of the own car, in the vehicle frame.
  struct BodySample {
    Eigen::Vector3f position, normal;
    uint32_t material;
  };

  /// Throws std::logic_error if the camera has no vehicle_from_camera; `body` may be null.
  CameraView(const RigCamera& camera, std::shared_ptr<const VehicleBody> body,
             const LensOptions& lens = LensOptions());

  const RigCamera& camera() const { return camera_; }
  const VehicleBody* body() const { return body_.get(); }
  cv::Size size() const { return camera_.image_size_px; }
  int blocksPerRow() const { return blocks_per_row_; }
  int blockRows() const { return block_rows_; }

  /// Unit rays of the samples of a block in the camera frame: 16 x, 16 y, 16 z.
  const float* blockRays(size_t block) const { return &sample_rays_[block * 3 * kSamplesPerBlock]; }
  /// Bit p is set where pixel p of the block is inside the field of view.
  uint8_t blockPixels(size_t block) const { return block_pixels_[block]; }
  /// Bit i is set where sample i meets the own car; these samples start at
  /// bodySamples()[blockBodyStart(block)].
  uint16_t blockBodyMask(size_t block) const { return block_body_mask_[block]; }
  size_t blockBodyStart(size_t block) const { return block_body_start_[block]; }
  const std::vector<BodySample>& bodySamples() const { return body_samples_; }

  /// Unit ray through a pixel centre in the camera frame; zero outside the field of view.
  Eigen::Vector3f centreRay(int x, int y) const {
    return centre_rays_[static_cast<size_t>(y) * size().width + x];
  }
  /// Angle between neighbouring pixels (geometric mean over both directions).
  float pixelAngle(int x, int y) const { return pixel_angle_rad_[static_cast<size_t>(y) * size().width + x]; }
  /// CV_32FC1, fraction of the light transmitted by the lens.
  const cv::Mat& vignette() const { return vignette_; }
  const LensOptions& lens() const { return lens_; }
  const LensBlur& blur() const { return blur_; }
  /// CV_8UC1, 0 within two pixels of a sample that meets the own car, 255 elsewhere.
  const cv::Mat& mask() const { return mask_; }

 private:
  void computeRays(cv::Mat* sigma_px);
  void computePixelAngles();
  void findBody();
  void blurOutline(cv::Mat* sigma_px) const;

  RigCamera camera_;
  LensOptions lens_;
  std::shared_ptr<const VehicleBody> body_;
  int blocks_per_row_, block_rows_;
  std::vector<float> sample_rays_;
  std::vector<uint8_t> block_pixels_;
  std::vector<uint16_t> block_body_mask_;
  std::vector<size_t> block_body_start_;
  std::vector<BodySample> body_samples_;
  std::vector<Eigen::Vector3f> centre_rays_;
  std::vector<float> pixel_angle_rad_;
  cv::Mat vignette_, mask_;
  LensBlur blur_;
};

}  // namespace vcharge
