#pragma once

#include <cstdint>
#include <map>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "vcharge_core/frames/drive_source.h"
#include "vcharge_core/motion/trajectory.h"
#include "vcharge_core/sparse_map/sparse_map.h"
#include "vcharge_features/feature_extractor.h"
#include "vcharge_mapping/map_back_end.h"
#include "vcharge_mapping/sparse_mapper_options.h"
#include "vcharge_reconstruction/frame_gatherer.h"
#include "vcharge_reconstruction/frame_tracker.h"
#include "vcharge_reconstruction/mapping_state.h"

namespace vcharge {

/// Makes a sparse map of a drive (paper, section Sparse Mapping). Feed it the drive, then call finish().
/// Needs a rig with extrinsics. Data parallel inside; the same input gives the same map on any number of
/// threads.
class SparseMapper : public DriveConsumer {
 public:
  /// std::invalid_argument for bad options; InputError for a rig without extrinsics.
  SparseMapper(std::shared_ptr<const CameraRig> rig, const SparseMapperOptions& options);
  ~SparseMapper() override;

  void addImage(size_t camera_index, Timestamp stamp, const Image& image) override {
    gatherer_->addImage(camera_index, stamp, image);
  }
  void addOdometry(const VehicleOdometry& odometry) override { gatherer_->addOdometry(odometry); }

  /// The map of all that was fed. InputError where the drive does not suffice, saying why. Both callbacks may
  /// be empty, and may throw to end the work; `checkpoint` is called first with the stage "following".
  std::shared_ptr<const SparseMap> finish(const StageCallback& progress,
                                          const CheckpointCallback& checkpoint = CheckpointCallback());
  /// Instead of feeding the drive: goes on from what a checkpoint of a mapper with the same rig and options
  /// was given.
  void resume(MappingState state);

  const SparseMapperReport& report() const { return state_.report; }
  /// Poses of all frames that were followed, in the map, after finish().
  Trajectory trajectory() const { return trajectoryOf(state_); }
  /// What is known so far.
  const MappingState& state() const { return state_; }

 private:
  void processFrame(Timestamp stamp, const std::vector<Image>& images,
                    const RigidTransform& odom_from_vehicle);
  void addKeyframe(Timestamp stamp, const RigidTransform& odom_from_vehicle, MotionHypothesis motion);

  const std::shared_ptr<const CameraRig> rig_;
  const SparseMapperOptions options_;
  const std::unique_ptr<FeatureExtractor> extractor_;
  std::vector<CameraTracker> trackers_;  // by camera
  MappingState state_;
  std::unique_ptr<FrameGatherer> gatherer_;
  bool has_previous_ = false;
  RigidTransform previous_odom_from_vehicle_;
  RigidTransform map_from_previous_;
  double travelled_m_ = 0.0;
};

}  // namespace vcharge
