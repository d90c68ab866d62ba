#pragma once

#include <array>
#include <cstdint>
#include <functional>
#include <memory>
#include <string>
#include <vector>

#include <opencv2/core.hpp>

#include "vcharge_core/base/options.h"
#include "vcharge_core/camera/camera_rig.h"
#include "vcharge_core/dense_maps/obstacle_map.h"
#include "vcharge_core/frames/frame_assembler.h"
#include "vcharge_core/motion/vehicle_footprint.h"

namespace vcharge {

class SurroundRenderer;

/// The surface onto which the images are projected.
enum class SurroundSurface {
  kFlat,  ///< the ground plane z = 0 of the vehicle
  kBowl,  ///< the ground near the vehicle, rising farther out, so that what stands there is less stretched
};
template <>
inline std::vector<std::string> enumNames<SurroundSurface>() {
  return {"flat", "bowl"};
}

/// Options of SurroundView.
struct SurroundViewOptions {
  VCHARGE_BEGIN_OPTIONS(SurroundViewOptions);
  VCHARGE_OPTION(SurroundSurface, view, SurroundSurface::kFlat, anyValue(),
                 "Surface that is seen from above: level ground, or a bowl around the vehicle.");
  VCHARGE_OPTION(double, pixel_m, 0.025, between(0.005, 0.2), "Side length of a pixel on the ground.");
  VCHARGE_OPTION(double, reach_m, 7.0, between(1.0, 30.0),
                 "Distance from the sides of the vehicle to the rim of the view.");
  VCHARGE_OPTION_GROUP(VehicleFootprint, vehicle, {}, "The ground that the vehicle covers.");
  VCHARGE_END_OPTIONS();

  /// Waiting for images of one stamp and their odometry. A driver sees a view late if it waits for long.
  FrameAssemblerOptions frames = FrameAssemblerOptions::waiting(0.1, 0.1);
};

/// Labels of pixels that no camera's own index in the rig describes.
inline constexpr uint8_t kSurroundBlend = 253;    ///< two cameras, mixed
inline constexpr uint8_t kSurroundMemory = 254;   ///< ground that an earlier frame showed
inline constexpr uint8_t kSurroundUnknown = 255;  ///< never seen, or no camera's image

/// The surround view of one stamp. The images belong to the SurroundView and are valid during the callback.
struct SurroundFrame {
  Timestamp stamp;
  /// CV_8UC1, from above: x of the vehicle frame upwards, y to the left, the vehicle in the middle. Pixels
  /// without ground are hatched in dark gray.
  cv::Mat image;
  /// CV_8UC1: what each pixel shows (below the drawing of the vehicle): the index of a camera in the rig, or
  /// one of the constants above.
  cv::Mat labels;
  std::vector<double> gains;  ///< per camera: factor of its gray levels, 1 without an overlap
  /// Darkening of all images towards the rim: at an angle from the optical axis, whose square over that of a
  /// right angle is s, the logarithm of the brightness changes by shading[0] s + shading[1] s^2.
  std::array<double, 2> shading = {0.0, 0.0};
};

/// Joins the images of all cameras to one seamless view from above.
///
///  1. Tables that are computed once tell where each camera sees each pixel of the view, and how well: the
///     standard deviation on the ground that follows from the size of the camera's pixels there and from the
///     covariance of its extrinsics. Masks, field of view and the vehicle itself are left out.
///  2. The camera that sees a pixel best shows it; where two see it about equally well, they are mixed.
///  3. What stands on the ground is projected away from each camera, so that two cameras show it at two
///     places. On and behind obstacles of the obstacle map, everything that is connected comes from one
///     camera, without mixing.
///  4. Gains of the cameras are found from what they both see, as medians over the ground without obstacles.
///  5. Ground that no camera sees is filled from earlier frames by odometry, up to 1 m from the vehicle.
///  6. The vehicle is drawn over it, translucent.
///
/// The vehicle is taken to stand level, and all rows of all images to be exposed at the frame's stamp: tilts
/// of the body, rolling shutters and clock offsets (RigCamera::timing) are not corrected. Deterministic for
/// any number of threads; not thread safe.
class SurroundView : public DriveConsumer {
 public:
  using FrameCallback = std::function<void(const SurroundFrame&)>;

  /// `cameras`: names of the cameras to use; empty: all. InputError if the rig lacks one of them, its
  /// extrinsics, or if no camera sees ground; std::invalid_argument for bad options.
  SurroundView(std::shared_ptr<const CameraRig> rig, const SurroundViewOptions& options,
               FrameCallback on_frame, const std::vector<std::string>& cameras = {});
  ~SurroundView() override;

  /// InputError that names the camera if the image is not CV_8UC1 of its size.
  void addImage(size_t camera_index, Timestamp stamp, const Image& image) override;
  void addOdometry(const VehicleOdometry& odometry) override;
  /// Replaces the obstacles, which stand still in the frame `odom`. Maps in other frames are not used.
  void setObstacles(const ObstacleMap& map);
  /// Hands out the waiting frames at the end of the drive.
  void finish();
  const FrameCounters& counters() const { return assembler_->counters(); }

 private:
  const std::shared_ptr<const CameraRig> rig_;
  const FrameCallback on_frame_;
  std::vector<bool> is_used_;
  std::unique_ptr<SurroundRenderer> renderer_;
  std::unique_ptr<ImageFrameAssembler> assembler_;
};

}  // namespace vcharge
