#pragma once

#include <cstdint>
#include <functional>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "vcharge_core/camera/camera_rig.h"
#include "vcharge_core/camera/working_camera.h"
#include "vcharge_core/dense_maps/range_map.h"
#include "vcharge_core/frames/frame_assembler.h"
#include "vcharge_core/motion/trajectory.h"
#include "vcharge_dense/neighbour_selection.h"
#include "vcharge_dense/plane_sweep.h"

namespace vcharge {

/// Settings of neighbours and planes that trade accuracy for time (package README, Settings).
enum class RangePreset { kFast, kDefault, kAccurate };
template <>
inline std::vector<std::string> enumNames<RangePreset>() {
  return {"fast", "default", "accurate"};
}

struct RangeMapperOptions {
  RangePreset preset = RangePreset::kDefault;  ///< where it is read, it comes before all other fields
  std::vector<std::string> cameras;            ///< of the rig, by name; empty: all
  bool use_later_images =
      false;                   ///< neighbours on both sides: needs images from after the reference (offline)
  double min_motion_m = 0.03;  ///< of a camera between two references; below it the vehicle stands
  WorkingCameraOptions working_camera;
  NeighbourOptions neighbours;
  PlaneSweepOptions plane_sweep;
  FrameAssemblerOptions frames;

  RangeMapperOptions() {
    frames.max_speed_m_per_s = 60.0;
    plane_sweep.refine_poses = true;  // a drive's poses are odometry's, as a rule
    plane_sweep.coarse_pass = true;
  }

  /// Neighbours before and after the reference, aggregated by reference-split.
  static RangeMapperOptions offline();

  /// Sets the fields that the preset stands for, and leaves the others.
  void usePreset(RangePreset new_preset);

  template <class Visitor>
  void visitFields(Visitor&& visit) {
    const RangePreset before = preset;
    visit("preset", preset);
    if (preset != before) {
      usePreset(preset);
    }
    visit("cameras", cameras);
    visit("use_later_images", use_later_images);
    visit("min_motion_m", min_motion_m);
    visit("working_camera", working_camera);
    visit("neighbours", neighbours);
    visit("plane_sweep", plane_sweep);
    visit("frames", frames);
  }
  void validate() const;  ///< throws std::invalid_argument naming the field
};

enum class RangeMapperState {
  kNoImages,       ///< none yet, or the camera stopped
  kNoPose,         ///< images come, but there is no odometry at their stamps
  kStanding,       ///< the camera does not move: motion stereo sees nothing
  kFewNeighbours,  ///< moving, but no image with enough baseline yet
  kMapping,
};

/// One camera's state, as plain data.
struct RangeMapperStatus {
  std::string camera_name;
  RangeMapperState state = RangeMapperState::kNoImages;
  std::string message;          ///< one line for people
  uint64_t images = 0;          ///< taken in
  uint64_t ignored_images = 0;  ///< repeated, or too late for their frame
  uint64_t without_pose = 0;
  uint64_t standing = 0;
  uint64_t without_neighbours = 0;
  uint64_t references = 0;  ///< handed out to be swept
  uint64_t resets = 0;      ///< started over: time or poses jumped, or odometry had a gap
};

/// A reference and its neighbours, ready to be swept. Shares the pixels, which nobody changes any more.
struct RangeTask {
  size_t camera_index = 0;  ///< of the rig
  SweepImage reference;
  std::vector<SweepImage> neighbours;
};

/// Turns the images and odometry of a drive into sweeps: undistorts, keeps the last images of each camera,
/// and picks neighbours by baseline. The one front of the nodelet and the offline tool.
///
/// add...() do cheap work and hand each reference to `on_task`, per camera in order of stamps; who gets it
/// calls sweep(), at once (nothing is lost) or later from another thread (only sweep() may be called
/// concurrently). References come once their neighbours have: with use_later_images after the vehicle has
/// moved on, or at finish(). While a camera stands nothing comes; status() says so. Stamps that jump back,
/// gaps of the odometry and poses that jump start the cameras over.
class RangeMapper : public DriveConsumer {
 public:
  using TaskCallback = std::function<void(RangeTask)>;

  /// InputError when the rig lacks a camera of the options or the pose of one on the vehicle;
  /// std::invalid_argument for bad options.
  RangeMapper(std::shared_ptr<const CameraRig> rig, const RangeMapperOptions& options, TaskCallback on_task);
  ~RangeMapper() override;

  /// Takes poses from here instead of from odometry; frames.max_odometry_gap_s applies.
  void setTrajectory(const Trajectory& world_from_vehicle);

  /// std::logic_error for an image of another size or type than the rig's.
  void addImage(size_t camera_index, Timestamp stamp, const Image& image) override;
  void addOdometry(const VehicleOdometry& odometry) override;
  /// Hands out what still waits for later images: the drive is over.
  void finish();

  /// Thread safe. camera_name and frame_id of the map are those of the rig; its reference is the task's.
  RangeMap sweep(const RangeTask& task) const;

  /// Of the cameras in use, in the rig's order.
  std::vector<RangeMapperStatus> status() const;
  const FrameCounters& counters() const { return assembler_->counters(); }

 private:
  struct Camera;

  void process(const ImageFrame& frame);
  void placeImage(Camera* camera, const ImageFrame& frame);
  void startOver(DriveBreak drive_break);
  void addFrame(Camera* camera, const SweepImage& frame);
  void emitReferences(Camera* camera, bool drive_is_over);
  void emitReference(Camera* camera, size_t index);

  const std::shared_ptr<const CameraRig> rig_;
  const RangeMapperOptions options_;
  const TaskCallback on_task_;
  std::vector<std::unique_ptr<Camera>> cameras_;  // by index in the rig; null where not in use
  std::unique_ptr<ImageFrameAssembler> assembler_;
};

}  // namespace vcharge
