#pragma once

#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "vcharge_calibration/from_map/map_rig_calibrator_options.h"
#include "vcharge_calibration/rig/rig_calibration.h"
#include "vcharge_core/frames/drive_source.h"
#include "vcharge_core/sparse_map/sparse_map.h"
#include "vcharge_reconstruction/keyframe_builder.h"
#include "vcharge_reconstruction/keyframe_images.h"
#include "vcharge_reconstruction/map_localizer.h"
#include "vcharge_reconstruction/reconstruction_state.h"
#include "vcharge_reconstruction/stage_runner.h"

namespace vcharge {

/// A keyframe of a drive in a map: its features, and the pose of each camera by its own image.
struct MapKeyframeView {
  RigFeatures features;
  /// One per camera; empty where it was not localized. Their map_from_vehicle is map_from_camera, since the
  /// localizer's rig has all cameras at its origin.
  std::vector<std::optional<PoseFix>> camera_fixes;
};

/// Calibrates the extrinsics of a rig from a drive in a finished map (paper, section Structure-based
/// Calibration). Needs no initial extrinsics, overlap of the cameras or loops: add the drive, then call
/// finish(). Each camera is localized by itself; extrinsics and vehicle poses follow from these poses and the
/// odometer, and are then adjusted to the observed landmarks. The map, of any rig, defines the scale, and the
/// height of base_link. Data parallel inside; the same input gives the same result on any number of threads.
class MapRigCalibrator : public DriveConsumer {
 public:
  /// std::invalid_argument for bad options; InputError for a rig without cameras, or a map that has
  /// features of an unknown kind.
  MapRigCalibrator(std::shared_ptr<const SparseMap> map, const CameraRig& rig,
                   const MapRigCalibratorOptions& options);
  ~MapRigCalibrator() override;

  void addImage(size_t camera_index, Timestamp stamp, const Image& image) override;
  void addOdometry(const VehicleOdometry& odometry) override;

  /// Adds a keyframe from its features instead of its images; the distance to the last keyframe is not
  /// checked.
  void addKeyframe(Timestamp stamp, RigFeatures features, const RigidTransform& odom_from_vehicle,
                   const FrameMotion& motion = FrameMotion());

  /// Calibrates from the drive so far. If the drive does not suffice, the verdict is kFail, with remarks why.
  /// The callback may be empty, and may throw to abandon the calibration.
  RigCalibration finish(const StageCallback& progress);

  /// Rig, poses and observed landmarks; valid after finish() unless the verdict is kFail.
  const ReconstructionState& state() const { return state_; }
  /// Small images of a few keyframes, for reports.
  const KeyframeImages& images() const { return images_; }
  /// HTML for the report: which landmarks are observed from which poses. Empty before finish() and after
  /// a failure.
  std::string reportSection() const;

 private:
  void processFrame(const ImageFrame& frame);
  RigidTransform motionSinceKeyframe(const RigidTransform& odom_from_vehicle) const;
  /// Localizes one camera by its own features, near the pose predicted by the odometer if there is one.
  std::optional<PoseFix> findCamera(const RigFeatures& features, size_t camera) const;

  const MapRigCalibratorOptions options_;
  const std::shared_ptr<const SparseMap> map_;
  std::shared_ptr<const CameraRig> rig_;  // all cameras at the vehicle's origin
  std::unique_ptr<MapLocalizer> localizer_;
  std::vector<MapKeyframeView> views_;
  KeyframeImages images_;
  std::vector<int32_t> landmark_of_track_;  // indices in the map, set by finish()
  ReconstructionState state_;
  KeyframeBuilder keyframes_;
  std::unique_ptr<FrameAssembler<Image>> assembler_;
  double travelled_m_ = 0.0;
};

}  // namespace vcharge
