#pragma once

#include <cstdint>
#include <map>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "vcharge_core/drive_source.h"
#include "vcharge_core/sparse_map.h"
#include "vcharge_core/trajectory.h"
#include "vcharge_core/vehicle_odometry.h"
#include "vcharge_features/feature_extractor.h"
#include "vcharge_mapping/frame_tracker.h"
#include "vcharge_mapping/map_back_end.h"
#include "vcharge_mapping/mapping_state.h"
#include "vcharge_mapping/sparse_mapper_options.h"

namespace vcharge {

/// Makes a sparse map of a drive (paper, section Sparse Mapping). Feed it the drive, then call finish().
/// Needs a rig with extrinsics. Data parallel inside; the same input gives the same map on any number of
/// threads.
class SparseMapper : public DriveConsumer {
 public:
  /// std::invalid_argument for bad options; InputError for a rig without extrinsics.
  SparseMapper(std::shared_ptr<const CameraRig> rig, const SparseMapperOptions& options);
  ~SparseMapper() override;

  void addImage(size_t camera_index, Timestamp stamp, const Image& image) override;
  void addOdometry(const VehicleOdometry& odometry) override;

  /// The map of all that was fed. InputError where the drive does not suffice, saying why. Both callbacks may
  /// be empty, and may throw to end the work; `checkpoint` is called first with the stage "following".
  std::shared_ptr<const SparseMap> finish(const StageCallback& progress,
                                          const CheckpointCallback& checkpoint = CheckpointCallback());
  /// Instead of feeding the drive: goes on from what a checkpoint of a mapper with the same rig and options
  /// was given.
  void resume(MappingState state);

  const SparseMapperReport& report() const { return state_.report; }
  /// Poses of all frames that were followed, in the map, after finish().
  Trajectory trajectory() const;
  /// What is known so far.
  const MappingState& state() const { return state_; }

 private:
  struct PendingFrame {
    std::vector<Image> images;
    size_t num_present = 0;
  };
  void processFrames(bool all);
  void processFrame(Timestamp stamp, const PendingFrame& frame, const RigidTransform& odom_from_vehicle);
  void addKeyframe(Timestamp stamp, const RigidTransform& odom_from_vehicle, MotionHypothesis motion);
  void noteSkipped(Timestamp stamp, const std::string& reason);
  std::string missingCameras(const PendingFrame& frame);

  const std::shared_ptr<const CameraRig> rig_;
  const SparseMapperOptions options_;
  const std::unique_ptr<FeatureExtractor> extractor_;
  std::vector<CameraTracker> trackers_;  // by camera
  OdometryBuffer odometry_;
  RigidTransform corrected_from_raw_odom_;
  std::optional<VehicleOdometry> last_raw_odometry_;
  std::map<Timestamp, PendingFrame> pending_;

  std::optional<Timestamp> last_stamp_;  // of a frame that had its turn
  MappingState state_;
  /// Which entry of the report a reason has last, and the number of the frame that it ends with.
  struct LastSkipped {
    size_t entry = 0;
    int64_t frame = 0;
  };
  std::map<std::string, LastSkipped> last_skipped_;  // by reason
  bool has_previous_ = false;
  RigidTransform previous_odom_from_vehicle_;
  RigidTransform map_from_previous_;
  double travelled_m_ = 0.0;
};

}  // namespace vcharge
