#pragma once

#include <memory>
#include <string>
#include <vector>

#include <opencv2/core.hpp>

#include "vcharge_calibration/intrinsics/intrinsic_calibration.h"
#include "vcharge_core/camera/camera_rig.h"
#include "vcharge_core/frames/frame_assembler.h"

namespace vcharge {

/// Options of BodyMaskEstimator.
struct BodyMaskOptions {
  VCHARGE_BEGIN_OPTIONS(BodyMaskOptions);
  VCHARGE_OPTION(double, sample_distance_m, 0.5, positive(),
                 "Motion between two images that are used; a turn of one radian counts as 2 m.");
  VCHARGE_OPTION(double, min_distance_m, 20.0, notNegative(), "Length that a drive must have.");
  VCHARGE_OPTION(
      double, min_heading_range_rad, 1.5, notNegative(),
      "Range of headings below which distant things and the own shadow may seem part of the body.");
  VCHARGE_END_OPTIONS();
};

/// Mask of one camera.
struct CameraBodyMask {
  std::string camera;
  Verdict verdict = Verdict::kFail;  ///< without a mask if kFail
  std::vector<std::string> remarks;  ///< reasons of the verdict
  cv::Mat mask;                      ///< CV_8UC1 of the camera's image size, 0 where the body is seen
  double body_fraction = 0.0;        ///< of the field of view
  double spot_fraction = 0.0;        ///< of the field of view: other static edges (dirt); not in the mask
  cv::Mat picture;                   ///< CV_8UC3: mean image with the mask, static edges, moving structure
};

/// Masks of a rig.
struct BodyMasks {
  Verdict verdict = Verdict::kFail;  ///< the worst of the cameras
  double distance_m = 0.0;
  double heading_range_rad = 0.0;
  int num_samples = 0;  ///< instants whose images were used
  std::vector<CameraBodyMask> cameras;
};

/// Finds in each camera the pixels that show the body of the own car, from a drive with odometry. The car's
/// edges stay in the image while all else moves; a minimum cut separates what they enclose at the border of
/// the field of view. Uses intrinsics, but neither extrinsics nor masks of the rig. Images are expected
/// upright. Keeps small copies of up to kMaxSamples images per camera. Not thread safe.
class BodyMaskEstimator : public DriveConsumer {
 public:
  static constexpr size_t kMaxSamples = 160;

  /// std::invalid_argument for bad options; InputError for a rig without cameras.
  explicit BodyMaskEstimator(std::shared_ptr<const CameraRig> rig,
                             const BodyMaskOptions& options = BodyMaskOptions());

  void addImage(size_t camera_index, Timestamp stamp, const Image& image) override;
  void addOdometry(const VehicleOdometry& odometry) override;
  /// Masks from the drive so far. Cameras are processed in parallel; the result does not depend on the number
  /// of threads.
  BodyMasks result();

 private:
  struct Sample {
    double heading_rad;
    std::vector<cv::Mat> images;  // small; empty where a camera sent none
  };
  void addFrame(const ImageFrame& frame);
  std::vector<double> weights() const;
  double headingRange() const;

  const std::shared_ptr<const CameraRig> rig_;
  const BodyMaskOptions options_;
  FrameAssembler<Image> assembler_;
  std::vector<Sample> samples_;
  std::optional<RigidTransform> last_pose_;
  int num_reached_ = 0;  // poses at sample_distance_m, of which every stride_-th is kept
  int stride_ = 1;
  double distance_m_ = 0.0;
};

}  // namespace vcharge
