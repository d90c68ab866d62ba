#pragma once

#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "vcharge_calibration/from_map/map_rig_calibrator_options.h"
#include "vcharge_calibration/matching/keyframe_images.h"
#include "vcharge_calibration/rig/rig_calibration.h"
#include "vcharge_core/frames/drive_source.h"
#include "vcharge_core/motion/trajectory.h"
#include "vcharge_core/sparse_map/sparse_map.h"
#include "vcharge_reconstruction/stage_progress.h"
#include "vcharge_reconstruction/frame_gatherer.h"
#include "vcharge_reconstruction/map_localizer.h"
#include "vcharge_reconstruction/mapping_state.h"

namespace vcharge {

/// A keyframe of a drive in a map: what its cameras show, and where each of them is by itself.
struct MapKeyframeView {
  RigFeatures features;
  std::vector<std::optional<PoseFix>> camera_fixes;  ///< map_from_vehicle is that of the camera
};

/// Calibrates the extrinsics of a rig from a drive in a finished map (paper, section Structure-based
/// Calibration): no guess, no overlap, no loop. Each camera is looked for in the map alone; extrinsics and
/// vehicle poses follow from that and the odometer, then the weighted reprojection errors of the map's
/// landmarks are made small. The map, of whatever rig, is the measure of all lengths, and its vehicle stood
/// where this one's base_link is in height. Feed it the drive, then call finish(). Data parallel inside; the
/// same input gives the same result on any number of threads.
class MapRigCalibrator : public DriveConsumer {
 public:
  /// std::invalid_argument for bad options; InputError for a rig without cameras or a map that no extractor
  /// of this program can have made.
  MapRigCalibrator(std::shared_ptr<const SparseMap> map, const CameraRig& rig,
                   const MapRigCalibratorOptions& options);
  ~MapRigCalibrator() override;

  void addImage(size_t camera_index, Timestamp stamp, const Image& image) override {
    gatherer_->addImage(camera_index, stamp, image);
  }
  void addOdometry(const VehicleOdometry& odometry) override { gatherer_->addOdometry(odometry); }

  /// What the images of a keyframe show: where images and odometry lead to.
  void addKeyframe(Timestamp stamp, RigFeatures features, const RigidTransform& odom_from_vehicle);

  /// The calibration by all that was fed. A drive that does not suffice gives Verdict::kFail with the reason.
  /// The callback may be empty, and may throw to end the work.
  RigCalibration finish(const StageCallback& progress);

  /// After finish() with another verdict than kFail: poses of all frames in the map.
  Trajectory trajectory() const { return trajectoryOf(state_); }
  const MappingState& state() const { return state_; }
  /// Of a few keyframes, for pictures.
  const KeyframeImages& images() const { return images_; }
  /// For the report: which landmarks of the map are seen from where, in the colours of the cameras that saw
  /// them first. HTML; empty before finish() and after a failure.
  std::string reportSection() const;

 private:
  void processFrame(Timestamp stamp, const std::vector<Image>& images,
                    const RigidTransform& odom_from_vehicle);
  std::optional<PoseFix> findCamera(const RigFeatures& features, size_t camera) const;

  const MapRigCalibratorOptions options_;
  const std::shared_ptr<const SparseMap> map_;
  std::shared_ptr<const CameraRig> rig_;  ///< each camera is where the vehicle is
  std::unique_ptr<MapLocalizer> localizer_;
  std::vector<MapKeyframeView> views_;
  KeyframeImages images_;
  std::vector<int32_t> landmark_of_track_;  ///< of the map, after finish()
  MappingState state_;
  std::unique_ptr<FrameGatherer> gatherer_;
  double travelled_m_ = 0.0;
};

}  // namespace vcharge
