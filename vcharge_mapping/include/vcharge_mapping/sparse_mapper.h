#pragma once

#include <array>
#include <cstdint>
#include <functional>
#include <map>
#include <memory>
#include <string>
#include <vector>

#include "vcharge_core/drive_source.h"
#include "vcharge_core/options.h"
#include "vcharge_core/sparse_map.h"
#include "vcharge_core/trajectory.h"
#include "vcharge_core/vehicle_odometry.h"
#include "vcharge_features/feature_extractor.h"
#include "vcharge_mapping/bundle_adjustment.h"
#include "vcharge_mapping/ego_motion.h"
#include "vcharge_mapping/frame_tracker.h"
#include "vcharge_mapping/landmark_search.h"
#include "vcharge_mapping/loop_closure.h"
#include "vcharge_mapping/triangulation.h"

namespace vcharge {

struct SparseMapperOptions {
  double frame_distance_m = 0.05;  ///< frames between which the vehicle moved less are left out
  double frame_turn_rad = 0.01;    ///< and turned less
  double keyframe_distance_m = 0.5;
  double keyframe_turn_rad = 0.1;
  double max_speed_m_per_s = 25.0;    ///< faster odometry is a reset of the counters
  double first_max_error_rad = 0.02;  ///< of rays to their point by poses that were not adjusted yet
  FeatureExtractorOptions features;
  FrameTrackerOptions tracker;
  EgoMotionOptions ego_motion;
  TriangulationOptions triangulation;
  LoopClosureOptions loops;
  LandmarkSearchOptions search;
  BundleAdjustmentOptions bundle;

  template <class Visitor>
  void visitFields(Visitor&& visit) {
    visit("frame_distance_m", frame_distance_m);
    visit("frame_turn_rad", frame_turn_rad);
    visit("keyframe_distance_m", keyframe_distance_m);
    visit("keyframe_turn_rad", keyframe_turn_rad);
    visit("max_speed_m_per_s", max_speed_m_per_s);
    visit("first_max_error_rad", first_max_error_rad);
    visit("features", features);
    visit("tracker", tracker);
    visit("ego_motion", ego_motion);
    visit("triangulation", triangulation);
    visit("loops", loops);
    visit("search", search);
    visit("bundle", bundle);
  }
  void validate() const;  ///< throws std::invalid_argument naming the field
};

/// What became of a drive, in numbers.
struct SparseMapperReport {
  int64_t num_frames = 0;             ///< images of one stamp
  int64_t num_incomplete_frames = 0;  ///< of these: a camera was missing
  int64_t num_frames_without_odometry = 0;
  int64_t num_standing_frames = 0;
  int64_t num_odometry_resets = 0;
  std::array<int64_t, 4> num_motions{};  ///< by MotionHypothesis
  int64_t num_landmarks = 0;
  int64_t num_observations = 0;
  double rms_px = 0.0;
  std::vector<LoopEdge> loop_edges;
  std::map<std::string, double> stage_s;  ///< wall time
};

/// Makes a sparse map of a drive (paper, section Sparse Mapping). Feed it the drive, then call finish().
/// Needs a rig with extrinsics. Data parallel inside; the same input gives the same map on any number of
/// threads.
class SparseMapper : public DriveConsumer {
 public:
  using Progress = std::function<void(const std::string& stage, double fraction)>;

  /// std::invalid_argument for bad options; InputError for a rig without extrinsics.
  SparseMapper(std::shared_ptr<const CameraRig> rig, const SparseMapperOptions& options);
  ~SparseMapper() override;

  void addImage(size_t camera_index, Timestamp stamp, const Image& image) override;
  void addOdometry(const VehicleOdometry& odometry) override;

  /// The map of all that was fed. InputError where the drive does not suffice, saying why.
  std::shared_ptr<const SparseMap> finish(const Progress& progress);

  const SparseMapperReport& report() const { return report_; }
  /// Poses of all frames that were followed, in the map, after finish().
  Trajectory trajectory() const;

 private:
  struct PendingFrame {
    std::vector<Image> images;
    size_t num_present = 0;
  };
  void processFrames(bool all);
  void processFrame(Timestamp stamp, const PendingFrame& frame, const RigidTransform& odom_from_vehicle);
  void addKeyframe(Timestamp stamp, const RigidTransform& odom_from_vehicle);

  const std::shared_ptr<const CameraRig> rig_;
  const SparseMapperOptions options_;
  const std::unique_ptr<FeatureExtractor> extractor_;
  std::vector<CameraTracker> trackers_;  // by camera
  OdometryBuffer odometry_;
  RigidTransform corrected_from_raw_odom_;
  std::optional<VehicleOdometry> last_raw_odometry_;
  std::map<Timestamp, PendingFrame> pending_;

  struct FramePose {
    Timestamp stamp;
    int32_t keyframe = 0;
    RigidTransform keyframe_from_vehicle;
  };
  MappingData data_;
  std::vector<FramePose> frames_;                   // that were followed
  std::vector<RigidTransform> keyframe_from_next_;  // as the motions between them add up
  bool has_previous_ = false;
  RigidTransform previous_odom_from_vehicle_;
  RigidTransform map_from_previous_;
  double travelled_m_ = 0.0;
  SparseMapperReport report_;
};

}  // namespace vcharge
