#pragma once

#include <cstdint>
#include <functional>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "vcharge_core/camera/camera_rig.h"
#include "vcharge_core/dense_maps/range_map.h"
#include "vcharge_core/frames/frame_assembler.h"
#include "vcharge_obstacles/ground_watch.h"
#include "vcharge_obstacles/local_obstacle_map.h"
#include "vcharge_obstacles/obstacle_detector.h"

namespace vcharge {

/// Where the map's cells stay: in odometry's frame, or in the map's, which they follow when localization
/// moves it.
enum class FixedFrame { kOdom, kMap };
template <>
inline std::vector<std::string> enumNames<FixedFrame>() {
  return {"odom", "map"};
}

struct ObstacleMapperOptions {
  std::vector<std::string> cameras;  ///< of the rig, by name; empty: all
  FixedFrame fixed_frame = FixedFrame::kOdom;
  ObstacleDetectorOptions detector;
  GroundWatchOptions watch;
  LocalObstacleMapOptions map;
  FrameAssemblerOptions frames;
  double silent_s = 0.5;         ///< after this time without any range map the map is shown all the same
  double max_silence_s = 1.0;    ///< a camera without range maps for longer, while driving, has stopped
  double min_known_share = 0.1;  ///< of a camera's pixels with a range; with less it hardly sees
  double anchor_step_m = 0.03;   ///< map -> odom moves the cells once it has changed by so much
  double anchor_step_rad = 0.003;

  ObstacleMapperOptions() {
    frames.max_speed_m_per_s = 60.0;
    frames.max_step_m = 0.15;  // the map's cells show errors that other stages do not
    frames.max_step_rad = 0.05;
  }

  template <class Visitor>
  void visitFields(Visitor&& visit) {
    visit("cameras", cameras);
    visit("fixed_frame", fixed_frame);
    visit("detector", detector);
    visit("watch", watch);
    visit("map", map);
    visit("frames", frames);
    visit("silent_s", silent_s);
    visit("max_silence_s", max_silence_s);
    visit("min_known_share", min_known_share);
    visit("anchor_step_m", anchor_step_m);
    visit("anchor_step_rad", anchor_step_rad);
  }
  void validate() const;  ///< throws std::invalid_argument naming the field
};

/// What a camera adds to the map at present.
enum class ObstacleCameraState {
  kNoRangeMaps,   ///< none yet, or they stopped while the vehicle drives
  kNoPose,        ///< range maps come, but there is no odometry at their stamps
  kStanding,      ///< the vehicle stands: motion stereo sees nothing
  kHardlySees,    ///< few ranges: night, dirt, no texture
  kGroundLost,    ///< the ground is tilted beyond the bounds: nothing is cleared
  kGroundUnsure,  ///< few ground points: nothing is cleared
  kMapping,
};
std::string toString(ObstacleCameraState state);

struct ObstacleCameraStatus {
  std::string camera_name;
  ObstacleCameraState state = ObstacleCameraState::kNoRangeMaps;
  std::string message;  ///< one line for people
  GroundPlane ground;   ///< of the last range map
  double known_share = 0.0;
  uint64_t range_maps = 0;
  uint64_t without_pose = 0;
  uint64_t late = 0;  ///< came after their stamp had been fused, and were left out
};

/// The map after all range maps of one stamp; where none come, from time to time; empty, where odometry
/// jumped. Stamps grow from frame to frame, until the drive starts over: range maps of a stamp that is no
/// later than the last frame's are fused without a frame of their own.
struct ObstacleFrame {
  ObstacleMap map;
  ObstacleScan scan;                     ///< of the fused map
  std::vector<CameraObstacles> cameras;  ///< that were added at this stamp, in the rig's order
  std::vector<ObstacleCameraStatus> status;
};

/// Turns range maps and odometry into obstacle maps: one front for the nodelet and the offline tool. Range
/// maps of one stamp are fused together, in the rig's order. Not thread safe.
class ObstacleMapper {
 public:
  using FrameCallback = std::function<void(const ObstacleFrame&)>;

  /// InputError when the rig lacks a camera of the options or the pose of one on the vehicle;
  /// std::invalid_argument for bad options.
  ObstacleMapper(std::shared_ptr<const CameraRig> rig, const ObstacleMapperOptions& options,
                 FrameCallback on_frame);
  ~ObstacleMapper();

  void addOdometry(const VehicleOdometry& odometry);
  /// From localization; needed for, and only heard with, fixed_frame: map.
  void setMapFromOdom(const RigidTransform& map_from_odom);
  /// InputError for a map of no camera in use, or made with another rig.
  void addRangeMap(const RangeMap& map);
  /// Fuses what still waits: the drive is over.
  void finish();

  /// Of the cameras in use, in the rig's order.
  std::vector<ObstacleCameraStatus> status() const;
  /// How often odometry jumped, and the map was emptied for it.
  uint64_t numJumps() const { return num_jumps_; }
  /// Stamps whose range maps wait for others, or for odometry.
  size_t numWaiting() const { return assembler_->numWaiting(); }
  const FrameCounters& counters() const { return assembler_->counters(); }
  const PolarGrid& grid() const { return grid_; }
  const ObstacleMapperOptions& options() const { return options_; }

 private:
  struct Camera;
  struct Observation {  // by one camera
    CameraObstacles obstacles;
    cv::Mat reference;  // the image, where the range map brought it
  };
  using Frame = AssembledFrame<Observation>;

  std::optional<RigidTransform> fixedFromVehicle(
      const std::optional<RigidTransform>& odom_from_vehicle) const;
  void process(Frame frame);
  void fuse(Frame* frame, const RigidTransform& fixed_from_vehicle);
  void noteWithoutPose(const Frame& frame);
  void emit(const LocalObstacleMap& map, const std::vector<const CameraObstacles*>& cameras);
  void emitAt(Timestamp stamp);
  void emitWhenSilent();
  void updateStatus(Camera* camera, const CameraObstacles& seen) const;
  void startOver(DriveBreak drive_break, Timestamp stamp);

  const std::shared_ptr<const CameraRig> rig_;
  const ObstacleMapperOptions options_;
  const FrameCallback on_frame_;
  const PolarGrid grid_;
  std::vector<std::unique_ptr<Camera>> cameras_;  // by index in the rig; null where not in use
  std::unique_ptr<FrameAssembler<Observation>> assembler_;
  LocalObstacleMap map_;
  std::optional<Timestamp> last_emitted_;
  std::optional<Timestamp> last_heard_;  // odometry's stamp when the last range map came
  RigidTransform map_from_odom_, anchor_;
  bool has_anchor_ = false;
  uint64_t num_jumps_ = 0;
};

}  // namespace vcharge
