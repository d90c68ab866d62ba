#pragma once

#include <functional>
#include <memory>
#include <string>
#include <vector>

#include "vcharge_core/base/options.h"
#include "vcharge_core/camera/camera_rig.h"
#include "vcharge_core/camera/working_camera.h"
#include "vcharge_core/dense_maps/obstacle_map.h"
#include "vcharge_core/frames/frame_assembler.h"
#include "vcharge_core/motion/tracked_object.h"

namespace vcharge {

class ObjectCamera;
class PersonLikeness;

/// Options of ObjectTracker.
struct ObjectTrackerOptions {
  VCHARGE_BEGIN_OPTIONS(ObjectTrackerOptions);
  VCHARGE_OPTION(std::vector<std::string>, cameras, {}, anyValue(),
                 "Cameras of the rig by name; empty: all.");
  VCHARGE_OPTION(double, max_range_m, 12.0, above(1.0).upTo(100.0),
                 "Distance from a camera up to which objects are followed.");
  VCHARGE_OPTION(int, image_width_px, 640, between(160, 4096),
                 "Largest width of the undistorted images in which points are followed.");
  VCHARGE_OPTION(bool, ignore_hidden, true, anyValue(),
                 "Whether objects behind obstacles of the obstacle map are left out, driving.");
  VCHARGE_END_OPTIONS();

  FrameAssemblerOptions frames;  ///< waiting for images of one stamp, and odometry
};

/// Finds what moves around the vehicle, while it drives and while it stands, and follows it in the odometry's
/// frame. Works on single cameras and short intervals; what stands still is known from the obstacle map:
///
///  1. Points are followed through the images of each camera for 0.4 s.
///  2. A rotation of the body that the wheels did not measure is estimated from all of them.
///  3. A point moves if no static point on or above the ground explains its two rays within their errors.
///     Where the ground mirrors, static points below it are reflections.
///  4. Moving points are set on the ground where the image, compared with an earlier one that is warped by
///     the ground plane, begins to differ below them.
///  5. Groups of points get a position, a velocity and their covariances.
///  6. Narrow things that stand apart on the ground are followed by their contacts: somebody who comes
///     straight ahead moves in the image as something static that is nearer would.
///  7. A Kalman filter per object joins cameras and time.
///  8. Objects without points are found by their whole body in the next image, and by their contact.
///  9. What looks like a person (OpenCV's classifier) is reported sooner: at a speed that would not do for
///     anything else. What does not move is never reported, whatever it looks like.
/// 10. While the vehicle drives, objects that an obstacle of the obstacle map hides from all cameras are
///     left out.
///
/// Deterministic; not thread safe.
class ObjectTracker : public DriveConsumer {
 public:
  using FrameCallback = std::function<void(const ObjectFrame&)>;

  /// InputError if the rig lacks a camera of the options, or its extrinsics; std::invalid_argument for bad
  /// options.
  ObjectTracker(std::shared_ptr<const CameraRig> rig, const ObjectTrackerOptions& options,
                FrameCallback on_frame);
  ~ObjectTracker() override;

  /// Cameras that get a turn at a stamp, of those that have an image (one value per camera of the rig). The
  /// others keep what they follow until their next turn.
  using CameraChoice = std::function<std::vector<size_t>(Timestamp, const std::vector<bool>& has_image)>;
  /// Without a choice, all cameras have a turn at every stamp.
  void setCameraChoice(CameraChoice choose) { choose_ = std::move(choose); }

  void addImage(size_t camera_index, Timestamp stamp, const Image& image) override;
  void addOdometry(const VehicleOdometry& odometry) override;
  /// Replaces the obstacles that hide objects of the following images. Only maps in the frame `odom` are
  /// used.
  void setObstacles(const ObstacleMap& map);
  /// Hands out the waiting frames at the end of the drive.
  void finish();
  const FrameCounters& counters() const { return assembler_->counters(); }

 private:
  struct State;

  void process(const ImageFrame& frame);
  std::vector<size_t> addImages(const ImageFrame& frame);
  void findObjects(const std::vector<ObjectCamera*>& cameras, bool is_at_rest);
  void startOver();

  const std::shared_ptr<const CameraRig> rig_;
  const ObjectTrackerOptions options_;
  const FrameCallback on_frame_;
  CameraChoice choose_;
  std::vector<std::unique_ptr<ObjectCamera>> cameras_;  // indexed as in the rig; null: not in use
  std::unique_ptr<State> state_;
  std::unique_ptr<const PersonLikeness> people_;
  std::unique_ptr<ImageFrameAssembler> assembler_;
};

}  // namespace vcharge
