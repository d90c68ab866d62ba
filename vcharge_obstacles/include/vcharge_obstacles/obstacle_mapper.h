#pragma once

#include <cstdint>
#include <functional>
#include <map>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "vcharge_core/camera/camera_rig.h"
#include "vcharge_core/dense_maps/range_map.h"
#include "vcharge_core/motion/vehicle_odometry.h"
#include "vcharge_obstacles/ground_watch.h"
#include "vcharge_obstacles/local_obstacle_map.h"
#include "vcharge_obstacles/obstacle_detector.h"

namespace vcharge {

/// Frame in which the map's cells are fixed: the odometry's, or the sparse map's, in which localization
/// corrects them.
enum class FixedFrame { kOdom, kMap };
template <>
inline std::vector<std::string> enumNames<FixedFrame>() {
  return {"odom", "map"};
}

struct ObstacleMapperOptions {
  VCHARGE_BEGIN_OPTIONS(ObstacleMapperOptions);
  VCHARGE_OPTION(std::vector<std::string>, cameras, {}, anyValue(),
                 "Cameras of the rig by name; empty: all.");
  VCHARGE_OPTION(FixedFrame, fixed_frame, FixedFrame::kOdom, anyValue(),
                 "Frame in which the cells are fixed.");
  VCHARGE_OPTION_GROUP(ObstacleDetectorOptions, detector, {}, "Obstacles in one range map.");
  VCHARGE_OPTION_GROUP(GroundWatchOptions, watch, {}, "Ground whose appearance changes.");
  VCHARGE_OPTION_GROUP(LocalObstacleMapOptions, map, {}, "Fusion over time and cameras.");
  VCHARGE_OPTION_GROUP(OdometryBufferOptions, odometry, {}, "Interpolation of the odometry.");
  VCHARGE_OPTION(double, max_wait_s, 0.15, notNegative(),
                 "Time to wait for the other cameras' range maps of a stamp.");
  VCHARGE_OPTION(double, max_silence_s, 1.0, positive(),
                 "Time without range maps after which a camera has stopped.");
  VCHARGE_OPTION(double, min_known_fraction, 0.1, atLeast(0.0).below(1.0),
                 "Fraction of pixels with a range below which a camera hardly sees.");
  VCHARGE_OPTION(double, max_step_m, 0.15, positive(),
                 "Largest deviation of the odometry from constant velocity between two messages.");
  VCHARGE_OPTION(double, max_step_rad, 0.05, positive(), "Largest such deviation of the heading.");
  VCHARGE_END_OPTIONS();
};

/// What a camera contributes to the map at present.
enum class ObstacleCameraState {
  kNoRangeMaps,   ///< none yet, or they stopped while the vehicle drives
  kNoPose,        ///< there is no odometry at the range maps' stamps
  kStanding,      ///< the vehicle stands: motion stereo measures nothing
  kHardlySees,    ///< few ranges: night, dirt, no texture
  kGroundLost,    ///< the ground is tilted beyond the bounds: nothing is cleared
  kGroundUnsure,  ///< few ground points: nothing is cleared
  kMapping,
};
std::string toString(ObstacleCameraState state);

struct ObstacleCameraStatus {
  std::string camera_name;
  ObstacleCameraState state = ObstacleCameraState::kNoRangeMaps;
  std::string message;  ///< one line for the user
  GroundPlane ground;   ///< of the last range map
  double known_fraction = 0.0;
  uint64_t range_maps = 0;
  uint64_t without_pose = 0;
  uint64_t late = 0;  ///< ignored, because their stamp was fused before
};

/// The map after all range maps of one stamp. Without range maps a frame is emitted from time to time, and
/// after a jump of the odometry an empty one at once. Stamps increase until the drive starts over: range maps
/// that are not newer than the last frame are fused without a frame of their own.
struct ObstacleFrame {
  ObstacleMap map;
  ObstacleScan scan;                     ///< through the fused map
  std::vector<CameraObstacles> cameras;  ///< added at this stamp, in the rig's order
  std::vector<ObstacleCameraStatus> status;
};

/// Turns range maps and odometry into obstacle maps, for the nodelet and the offline tool alike. Range maps
/// of one stamp are fused together, in the rig's order, once odometry has reached the stamp. At most 25
/// stamps wait for odometry or for a camera. Not thread safe.
class ObstacleMapper {
 public:
  using FrameCallback = std::function<void(const ObstacleFrame&)>;

  /// InputError if the rig lacks a camera of the options, or its extrinsics; std::invalid_argument for bad
  /// options.
  ObstacleMapper(std::shared_ptr<const CameraRig> rig, const ObstacleMapperOptions& options,
                 FrameCallback on_frame);
  ~ObstacleMapper();

  void addOdometry(const VehicleOdometry& odometry);
  /// Localization's correction. Required with fixed_frame: map, ignored otherwise.
  void setMapFromOdom(const RigidTransform& map_from_odom);
  /// InputError for a range map of a camera that is not in use, or that was made with another rig.
  void addRangeMap(const RangeMap& map);
  /// Fuses what still waits at the end of the drive.
  void finish();

  /// One entry per camera in use, in the rig's order.
  std::vector<ObstacleCameraStatus> status() const;
  /// Number of times that the map was emptied because the odometry jumped.
  uint64_t numJumps() const { return num_jumps_; }
  /// Number of stamps that wait for range maps or odometry.
  size_t numWaiting() const { return waiting_.size(); }

 private:
  struct Camera;
  struct Observation {
    CameraObstacles seen;
    cv::Mat reference;  // the image of the range map; may be empty
  };
  struct Group {  // range maps of one stamp, by camera
    std::map<size_t, Observation> cameras;
    std::optional<Timestamp> first_heard;  // odometry's stamp when the first of them came
  };

  std::optional<RigidTransform> fixedFromVehicle(Timestamp stamp) const;
  void watchForJumps(const VehicleOdometry& odometry);
  bool isComplete(Timestamp stamp, const Group& group) const;
  void fuseWaiting(bool all);
  void fuse(Timestamp stamp, Group* group, const RigidTransform& fixed_from_vehicle);
  void loseFirstWaiting();
  void emit(const LocalObstacleMap& map, const std::vector<const CameraObstacles*>& cameras);
  void emitAt(Timestamp stamp);
  void emitWhenSilent();
  void updateStatus(Camera* camera, const CameraObstacles& seen) const;
  void startOver();
  void jump(Timestamp stamp);

  const std::shared_ptr<const CameraRig> rig_;
  const ObstacleMapperOptions options_;
  const FrameCallback on_frame_;
  const PolarGrid grid_;
  std::vector<std::unique_ptr<Camera>> cameras_;  // by index in the rig; null where not in use
  OdometryBuffer poses_;
  LocalObstacleMap map_;
  std::map<Timestamp, Group> waiting_;
  std::optional<Timestamp> last_fused_, last_emitted_, last_jump_;
  std::optional<Timestamp> last_heard_;  // odometry's stamp when the last range map came
  std::optional<VehicleOdometry> last_odometry_;
  std::optional<Eigen::Vector3d> last_velocity_;  // x, y, yaw per second
  RigidTransform map_from_odom_, anchor_;
  bool has_anchor_ = false;
  uint64_t num_jumps_ = 0;
};

}  // namespace vcharge
