#pragma once

#include <functional>
#include <memory>
#include <optional>
#include <vector>

#include "vcharge_calibration/matching/keyframe_images.h"
#include "vcharge_calibration/rig/rig_calibration.h"
#include "vcharge_calibration/rig/rig_calibrator_options.h"
#include "vcharge_core/frames/drive_source.h"
#include "vcharge_core/motion/trajectory.h"
#include "vcharge_core/sparse_map/sparse_map.h"
#include "vcharge_reconstruction/stage_progress.h"
#include "vcharge_reconstruction/frame_gatherer.h"
#include "vcharge_reconstruction/frame_tracker.h"
#include "vcharge_reconstruction/mapping_state.h"

namespace vcharge {

/// Calibrates the extrinsics of a rig from a drive (paper, section SLAM-based Extrinsic Calibration): no
/// guess, no overlap of the cameras, no board. Feed it the drive, then call finish(). Extrinsics that the rig
/// has are not used. Data parallel inside; the same input gives the same result on any number of threads.
class RigCalibrator : public DriveConsumer {
 public:
  /// std::invalid_argument for bad options; InputError for a rig without cameras.
  RigCalibrator(const std::shared_ptr<const CameraRig>& rig, const RigCalibratorOptions& options);
  ~RigCalibrator() override;

  void addImage(size_t camera_index, Timestamp stamp, const Image& image) override {
    gatherer_->addImage(camera_index, stamp, image);
  }
  void addOdometry(const VehicleOdometry& odometry) override { gatherer_->addOdometry(odometry); }

  /// Takes the frames that wait for odometry: none that is older will come.
  void flush() { gatherer_->finish(); }

  /// The calibration by all that was fed. A drive that does not suffice gives Verdict::kFail with the reason.
  /// The callback may be empty, and may throw to end the work.
  RigCalibration finish(const StageCallback& progress);

  /// After finish() with another verdict than kFail: poses of all frames, and the map that came with them.
  Trajectory trajectory() const { return trajectoryOf(state_); }
  std::shared_ptr<const SparseMap> map() const;
  const MappingState& state() const { return state_; }
  /// Of a few keyframes, for pictures.
  const KeyframeImages& images() const { return images_; }
  /// Of all keyframes whose patches are matched between cameras or aligned.
  const KeyframeImages& allImages() const { return all_images_; }

 private:
  void processFrame(Timestamp stamp, const std::vector<Image>& images,
                    const RigidTransform& odom_from_vehicle);
  void addKeyframe(Timestamp stamp, const std::vector<Image>& images,
                   const RigidTransform& odom_from_vehicle);

  const RigCalibratorOptions options_;
  std::shared_ptr<const CameraRig> rig_;  // without extrinsics
  const std::unique_ptr<FeatureExtractor> extractor_;
  std::vector<CameraTracker> trackers_;
  MappingState state_;
  KeyframeImages images_;
  KeyframeImages all_images_ = KeyframeImages::ofAllKeyframes();
  std::unique_ptr<FrameGatherer> gatherer_;
  std::optional<RigidTransform> last_odom_from_vehicle_;
  double travelled_m_ = 0.0;
};

/// What RigCalibrator::finish() does with the drive that it followed. With copies of state() and allImages()
/// a drive can be calibrated while it goes on; `state` has the rig, the poses and the landmarks in the end.
RigCalibration calibrateFollowedDrive(const RigCalibratorOptions& options, const KeyframeImages& all_images,
                                      const StageCallback& progress, MappingState* state);

/// The sparse map that came with a calibration of another verdict than kFail.
std::shared_ptr<const SparseMap> mapOfCalibration(const RigCalibratorOptions& options,
                                                  const MappingState& state);

}  // namespace vcharge
