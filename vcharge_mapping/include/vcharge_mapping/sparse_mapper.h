#pragma once

#include <memory>

#include "vcharge_core/frames/drive_source.h"
#include "vcharge_core/motion/trajectory.h"
#include "vcharge_core/sparse_map/sparse_map.h"
#include "vcharge_mapping/sparse_mapper_options.h"
#include "vcharge_reconstruction/frame_follower.h"
#include "vcharge_reconstruction/keyframe_images.h"
#include "vcharge_reconstruction/reconstruction_state.h"
#include "vcharge_reconstruction/stage_runner.h"

namespace vcharge {

/// Makes a sparse map of a drive (paper, section Sparse Mapping): add the drive, then call finish().
/// Needs a rig with extrinsics. Keeps the images of all keyframes, as JPEGs, until it ends. Data parallel
/// inside; the same input gives the same map on any number of threads.
class SparseMapper : public DriveConsumer {
 public:
  /// Number of stages of finish().
  static constexpr int kNumStages = 8;

  /// std::invalid_argument for bad options; InputError for a rig without extrinsics.
  SparseMapper(std::shared_ptr<const CameraRig> rig, const SparseMapperOptions& options);
  ~SparseMapper() override;

  void addImage(size_t camera_index, Timestamp stamp, const Image& image) override;
  void addOdometry(const VehicleOdometry& odometry) override;

  /// Makes the map of the drive so far. InputError, with reason, if the drive does not suffice. The callback
  /// may be empty, and may throw to end the work; the mapper must not be used afterwards.
  std::shared_ptr<const SparseMap> finish(const StageCallback& progress);

  const ReconstructionReport& report() const { return state_.report; }
  /// Poses of all frames in the map; valid after finish().
  Trajectory trajectory() const { return trajectoryOf(state_); }
  /// The current reconstruction.
  const ReconstructionState& state() const { return state_; }

 private:
  void requireKeyframes() const;
  void adjustFirst();
  void adjust(const BundleAdjustmentOptions& options, const OdometryNoise& odometry = {});

  const SparseMapperOptions options_;
  ReconstructionState state_;
  KeyframeImages images_ = KeyframeImages::ofAllKeyframes();
  std::unique_ptr<FrameFollower> follower_;
};

/// The map of a drive that goes on: landmarks are triangulated from the poses of tracking, nothing is
/// adjusted yet. It keeps what was driven if the rest is lost; mergeSession() adjusts it. InputError if the
/// drive does not suffice.
std::shared_ptr<const SparseMap> makeMapSoFar(ReconstructionState state, const SparseMapperOptions& options);

}  // namespace vcharge
