#pragma once

#include <memory>
#include <optional>
#include <vector>

#include "vcharge_calibration/rig/rig_calibration.h"
#include "vcharge_calibration/rig/rig_calibrator_options.h"
#include "vcharge_core/frames/drive_source.h"
#include "vcharge_core/sparse_map/sparse_map.h"
#include "vcharge_reconstruction/frame_follower.h"
#include "vcharge_reconstruction/keyframe_images.h"
#include "vcharge_reconstruction/reconstruction_state.h"
#include "vcharge_reconstruction/stage_runner.h"

namespace vcharge {

/// Calibrates the extrinsics of a rig from a drive (paper, section SLAM-based Extrinsic Calibration); needs
/// no initial extrinsics, overlap of cameras or board. Add the drive, then call finish(). Extrinsics of the
/// given rig are ignored. Data parallel inside; the same input gives the same result on any number of
/// threads.
class RigCalibrator : public DriveConsumer {
 public:
  /// std::invalid_argument for bad options; InputError for a rig without cameras.
  RigCalibrator(const std::shared_ptr<const CameraRig>& rig, const RigCalibratorOptions& options);
  ~RigCalibrator() override;

  void addImage(size_t camera_index, Timestamp stamp, const Image& image) override;
  void addOdometry(const VehicleOdometry& odometry) override;
  /// Processes the frames that are still waiting for images or odometry.
  void flush();

  /// Calibrates from the drive so far. If the drive does not suffice, the verdict is kFail, with remarks why.
  /// The callback may be empty, and may throw to abandon the calibration.
  RigCalibration finish(const StageCallback& progress);

  /// Map of the drive; valid after finish() unless the verdict is kFail.
  std::shared_ptr<const SparseMap> map() const;
  const ReconstructionState& state() const { return state_; }
  /// Small images of a few keyframes, for reports.
  const KeyframeImages& images() const { return images_; }
  /// Images of all keyframes, for matching between cameras and for patch alignment.
  const KeyframeImages& allImages() const { return all_images_; }

 private:
  const RigCalibratorOptions options_;
  ReconstructionState state_;
  KeyframeImages images_;
  KeyframeImages all_images_ = KeyframeImages::ofAllKeyframes();
  std::unique_ptr<FrameFollower> follower_;
};

/// A calibration that came as far as its verdict (it has landmarks), and the adjusted state.
struct RigCalibrationState {
  RigCalibration result;
  ReconstructionState state;
};

/// The steps of RigCalibrator::finish() on a recorded state. With copies of state() and allImages() it may
/// run while the drive goes on. Afterwards, `state` has the adjusted rig, poses and landmarks. Returns the
/// calibration.
///
/// With `earlier`, a calibration of the beginning of the same drive, it goes on from there: only what came
/// since is searched, and all is adjusted again. This takes a part of the time, and the result is as precise,
/// but depends on where the earlier one ended.
RigCalibration calibrateFollowedDrive(const RigCalibratorOptions& options, const KeyframeImages& all_images,
                                      const StageCallback& progress, ReconstructionState* state,
                                      std::optional<RigCalibrationState> earlier = std::nullopt);

/// The map of the drive, from the state after a calibration whose verdict is not kFail.
std::shared_ptr<const SparseMap> mapOfCalibration(const RigCalibratorOptions& options,
                                                  const ReconstructionState& state);

}  // namespace vcharge
