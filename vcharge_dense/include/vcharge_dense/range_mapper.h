#pragma once

#include <cstdint>
#include <functional>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "vcharge_core/camera/camera_rig.h"
#include "vcharge_core/camera/rig_condition.h"
#include "vcharge_core/camera/working_camera.h"
#include "vcharge_core/dense_maps/range_map.h"
#include "vcharge_core/frames/frame_assembler.h"
#include "vcharge_core/motion/trajectory.h"
#include "vcharge_dense/neighbour_selection.h"
#include "vcharge_dense/plane_sweep.h"

namespace vcharge {

class InterCameraStereo;
struct InstantImages;
class MotionRefinement;
class WorkingImages;

/// Numbers of planes, neighbours and refinement steps that trade accuracy for time.
enum class RangePreset { kFast, kDefault, kAccurate };
template <>
inline std::vector<std::string> enumNames<RangePreset>() {
  return {"fast", "default", "accurate"};
}

/// When a camera's image is also matched with the images of other cameras at its stamp, see RangeMapper.
enum class InterCamera {
  kOff,
  kStanding,  ///< where the camera's own earlier images give no parallax
  kAlways,    ///< also in addition to them
};
template <>
inline std::vector<std::string> enumNames<InterCamera>() {
  return {"off", "standing", "always"};
}

/// Options of RangeMapper.
struct RangeMapperOptions {
  VCHARGE_BEGIN_OPTIONS(RangeMapperOptions);
  VCHARGE_OPTION(RangePreset, preset, RangePreset::kDefault, anyValue(),
                 "Numbers of planes, neighbours and refinement steps, which options after it override.");
  VCHARGE_OPTION(std::vector<std::string>, cameras, {}, anyValue(),
                 "Cameras of the rig by name; empty: all.");
  VCHARGE_OPTION(bool, use_later_images, false, anyValue(),
                 "Neighbours are also taken from after the reference, which delays range maps.");
  VCHARGE_OPTION(InterCamera, inter_camera, InterCamera::kOff, anyValue(),
                 "Whether cameras with overlapping images are matched with each other: only while standing, "
                 "always, or not.");
  VCHARGE_OPTION(bool, remember, false, anyValue(),
                 "The last range map of a camera predicts the next one; most planes need not be swept then.");
  VCHARGE_OPTION_GROUP(WorkingCameraOptions, working_camera, {}, "Undistorted images that are swept.");
  VCHARGE_OPTION_GROUP(NeighbourOptions, neighbours, {}, "Images that a reference is matched with.");
  VCHARGE_OPTION_GROUP(PlaneSweepOptions, plane_sweep, {}, "Planes, scores and limits of reported ranges.");
  VCHARGE_OPTION_GROUP(FrameAssemblerOptions, frames, {}, "Images of one stamp, and odometry.");
  VCHARGE_END_OPTIONS();

  RangeMapperOptions() {
    frames.max_speed_m_per_s = 60.0;
    plane_sweep.coarse_pass = true;
  }

  /// Neighbours before and after the reference, aggregated by reference-split.
  static RangeMapperOptions offline();

  /// Sets the fields that the preset determines and leaves the others.
  void usePreset(RangePreset new_preset);

  void fieldWasRead(const char* field);
  void checkFields() const;
};

enum class RangeMapperState {
  kNoImages,       ///< no image yet, or the camera stopped sending
  kNoPose,         ///< there is no odometry at the images' stamps
  kStanding,       ///< the camera does not move: only other cameras' images give parallax
  kFewNeighbours,  ///< moving, but no image with enough baseline yet
  kMapping,
};

/// State and counters of one camera.
struct RangeMapperStatus {
  std::string camera_name;
  RangeMapperState state = RangeMapperState::kNoImages;
  std::string message;          ///< one line for the user
  uint64_t images = 0;          ///< images received
  uint64_t ignored_images = 0;  ///< repeated, or too late for their frame
  uint64_t without_pose = 0;
  uint64_t standing = 0;
  uint64_t without_neighbours = 0;
  uint64_t references = 0;    ///< references passed on to be swept
  uint64_t inter_camera = 0;  ///< those that are matched with images of other cameras
  uint64_t resets = 0;        ///< restarts because time or poses jumped or odometry had a gap
  bool has_moved = false;     ///< see RangeMapper::setCondition()
};

/// A reference and its neighbours, ready to be swept. The pixels are shared and never changed.
struct RangeTask {
  size_t camera_index = 0;  ///< index in the rig
  SweepImage reference;
  std::vector<SweepImage> neighbours;
  /// Images of all cameras at the reference's stamp, if the reference is matched with them; otherwise null.
  std::shared_ptr<const InstantImages> instant;
};

/// Turns the images and odometry of a drive into sweeps: undistorts images, keeps the latest of each camera,
/// interpolates their poses, refines them (see MotionRefinement), and selects neighbours by baseline. Used by
/// nodelets and offline tools.
///
/// addImage() and addOdometry() pass each reference to `on_task`, per camera in the order of stamps. The
/// callback calls sweep() at once or later from another thread; only sweep() may be called concurrently. A
/// reference is passed on once its neighbours are known: with use_later_images after the vehicle has moved
/// on, or in finish(). While a camera stands still there are no references, see status(). A camera restarts
/// and drops its images if stamps jump back, odometry has a gap or poses jump.
///
/// With inter_camera, references are matched with the images that other cameras took at the same stamp, where
/// both see the same. Alone only where standsAt() is true, also for cameras that stand still, and passed on
/// at once: elsewhere every range map has ranges from motion. With `always` also every reference with
/// neighbours: where an image has ranges of both kinds, they are fused by their variances, or unknown if they
/// contradict each other.
class RangeMapper : public DriveConsumer {
 public:
  using TaskCallback = std::function<void(RangeTask)>;

  /// Throws InputError if the rig lacks a camera of the options or its extrinsics, std::invalid_argument
  /// for bad options.
  RangeMapper(std::shared_ptr<const CameraRig> rig, const RangeMapperOptions& options, TaskCallback on_task);
  ~RangeMapper() override;

  /// Uses these poses instead of odometry, interpolated over gaps of at most frames.max_odometry_gap_s.
  void setTrajectory(const Trajectory& world_from_vehicle);

  /// From now on, cameras that moved are matched with their own images only, and the deviations of all
  /// extrinsics are part of the ranges'. At the beginning the condition is that of calibration.
  void setCondition(const RigCondition& condition);

  /// Throws std::logic_error for an image of another size or type than the rig's.
  void addImage(size_t camera_index, Timestamp stamp, const Image& image) override;
  void addOdometry(const VehicleOdometry& odometry) override;
  /// Ends the drive: passes on the references that still wait for later images.
  void finish();

  /// Thread safe. Camera name and frame of the range map come from the rig, its reference image from the
  /// task. With the option remember, results depend on the order of a camera's tasks.
  RangeMap sweep(const RangeTask& task) const;

  /// Status of the cameras in use, in the rig's order.
  std::vector<RangeMapperStatus> status() const;
  const FrameCounters& counters() const { return assembler_->counters(); }

 private:
  struct Camera;

  void process(const ImageFrame& frame);
  void followPoints(const ImageFrame& frame, WorkingImages* images);
  static void correctPoses(Camera* camera, const std::vector<CorrectedPose>& corrections);
  void addImageWithPose(Camera* camera, const ImageFrame& frame, WorkingImages* images);
  void startOver(DriveBreak drive_break);
  void addFrame(Camera* camera, const SweepImage& frame, std::shared_ptr<const InstantImages> instant);
  void emitReferences(Camera* camera, bool drive_is_over);
  void emitReference(Camera* camera, size_t index);
  /// A neighbour with its pose relative to the reference refined, and the noise of that pose.
  SweepImage refined(const Camera& camera, const SweepImage& neighbour, const SweepImage& reference);
  void emit(Camera* camera, RangeTask task);
  RangeMap sweepMotion(const RangeTask& task) const;

  const std::shared_ptr<const CameraRig> rig_;
  const RangeMapperOptions options_;
  const TaskCallback on_task_;
  RigCondition condition_;
  std::vector<std::unique_ptr<Camera>> cameras_;     // indexed as in the rig; null: not in use
  std::unique_ptr<const InterCameraStereo> stereo_;  // null: off
  std::unique_ptr<MotionRefinement> motion_;
  std::unique_ptr<ImageFrameAssembler> assembler_;
};

}  // namespace vcharge
