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
#include "vcharge_core/motion/vehicle_footprint.h"
#include "vcharge_obstacles/corridor.h"
#include "vcharge_obstacles/gap_finder.h"
#include "vcharge_obstacles/ground_watch.h"
#include "vcharge_obstacles/local_obstacle_map.h"
#include "vcharge_obstacles/obstacle_detector.h"
#include "vcharge_obstacles/step_mapper.h"

namespace vcharge {

class HiddenGround;
class PathCurvature;
class SilentCameras;
class StandingWatch;

/// Frame in which the map's cells are fixed: the odometry's frame, or the sparse map's frame, in which
/// localization corrects them.
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
  VCHARGE_OPTION_GROUP(VehicleFootprint, vehicle, {}, "The ground that the vehicle covers.");
  VCHARGE_OPTION_GROUP(ObstacleDetectorOptions, detector, {}, "Obstacles in one range map.");
  VCHARGE_OPTION_GROUP(GroundWatchOptions, watch, {}, "Ground whose appearance changes.");
  VCHARGE_OPTION_GROUP(LocalObstacleMapOptions, map, {}, "Fusion over time and cameras.");
  VCHARGE_OPTION_GROUP(StepMapperOptions, steps, {}, "Height of the ground near the vehicle.");
  VCHARGE_OPTION_GROUP(CorridorOptions, corridor, {}, "What the vehicle sweeps on its present arc.");
  VCHARGE_OPTION_GROUP(FrameAssemblerOptions, frames, {}, "Range maps of one stamp, and odometry.");
  VCHARGE_OPTION(double, max_silence_s, 1.0, positive(),
                 "Time without range maps after which a camera has stopped.");
  VCHARGE_OPTION(double, min_known_fraction, 0.1, atLeast(0.0).below(1.0),
                 "Fraction of pixels with a range below which a camera hardly sees.");
  VCHARGE_END_OPTIONS();

  ObstacleMapperOptions() {
    frames.max_speed_m_per_s = 60.0;
    frames.max_step_m = 0.15;  // smaller jumps than in other stages would be visible in the cells
    frames.max_step_rad = 0.05;
  }
};

/// Current contribution of a camera to the map.
enum class ObstacleCameraState {
  kNoRangeMaps,   ///< none yet, or they stopped during the drive
  kSilent,        ///< images have stopped: ground that no other camera sees is not free
  kFrozen,        ///< the images repeat one while the vehicle moves: as if silent, range maps are ignored
  kNoPose,        ///< no odometry at the range maps' stamps
  kStanding,      ///< the vehicle stands: only the overlap of cameras is measured, or nothing
  kHardlySees,    ///< few ranges: night, dirt, no texture
  kGroundLost,    ///< the ground is tilted beyond the bounds: no cell is cleared
  kGroundUnsure,  ///< few ground points: no cell is cleared
  kMapping,
};
std::string toString(ObstacleCameraState state);

struct ObstacleCameraStatus {
  std::string camera_name;
  ObstacleCameraState state = ObstacleCameraState::kNoRangeMaps;
  std::string message;  ///< one line for the user
  GroundPlane ground;   ///< ground plane of the last range map
  double known_fraction = 0.0;
  uint64_t range_maps = 0;
  uint64_t without_pose = 0;
  /// Mean time by which images are older than the odometry on their arrival; 0 without images.
  double image_lag_s = 0.0;
  uint64_t late = 0;  ///< ignored range maps: their stamp was already fused
};

/// The map after all range maps of one stamp. Without range maps, a frame is emitted from time to time, and
/// after a jump of the odometry an empty one at once. Stamps increase until the drive starts over: range maps
/// that are not newer than the last frame are fused without emitting a frame.
struct ObstacleFrame {
  ObstacleMap map;
  StepMap steps;      ///< kerbs, holes and other steps near the vehicle, also those too low for the map
  ObstacleScan scan;  ///< scan of the fused map
  Corridor corridor;  ///< for the curvature of the path that the vehicle drives
  std::vector<ParkingGap> gaps;          ///< beside the path, in which the vehicle can park
  std::vector<CameraObstacles> cameras;  ///< observations added at this stamp, in the rig's order
  std::vector<ObstacleCameraStatus> status;
};

/// Turns range maps and odometry into obstacle maps; used by the nodelet and the offline tool. Range maps
/// of one stamp are fused together, in the rig's order. Not thread safe.
class ObstacleMapper {
 public:
  using FrameCallback = std::function<void(const ObstacleFrame&)>;

  /// InputError if the rig lacks a camera of the options, or its extrinsics; std::invalid_argument for bad
  /// options.
  ObstacleMapper(std::shared_ptr<const CameraRig> rig, const ObstacleMapperOptions& options,
                 FrameCallback on_frame);
  ~ObstacleMapper();

  void addOdometry(const VehicleOdometry& odometry);
  /// Notes that an image of a camera has arrived, by fingerprintOf() its pixels. Without range maps, as while
  /// the vehicle stands, this shows that the camera is alive. A camera whose images stop, or repeat, for 0.3
  /// s is silent: free cells that it sees, and no living camera, become unobserved. A camera of which no
  /// image was ever noted does not count as silent. std::logic_error for an index beyond the rig.
  void noteImage(size_t camera_index, Timestamp stamp, uint64_t fingerprint);
  /// The same, with a function that gives the image's pixels (CV_8UC1 of the sensor's size) if they are
  /// needed: while the vehicle stands, free ground where the images change becomes unobserved.
  void addImage(size_t camera_index, Timestamp stamp, uint64_t fingerprint,
                const std::function<cv::Mat()>& pixels);
  /// Sets localization's correction. Required with fixed_frame: map, ignored otherwise.
  void setMapFromOdom(const RigidTransform& map_from_odom);
  /// Sets the objects that move around the vehicle, in the frame odom. They enter the corridors of the
  /// following frames, moved with their velocities, until they are replaced or kObjectLife_s old, and the
  /// ground under them is not free. They do not change what is fused.
  void setObjects(Timestamp stamp, std::vector<TrackedObject> objects);
  /// InputError for a range map of a camera that is not in use, or that was computed with another rig.
  void addRangeMap(const RangeMap& map);
  /// Announces the cameras of the rig whose range maps of a stamp will come: no others are waited for.
  void expectRangeMaps(Timestamp stamp, std::vector<bool> cameras);
  /// Fuses the waiting range maps at the end of the drive.
  void finish();

  /// One entry per camera in use, in the rig's order.
  std::vector<ObstacleCameraStatus> status() const;
  /// Number of times that the map was emptied because the odometry jumped.
  uint64_t numJumps() const { return num_jumps_; }
  /// Number of stamps that are waiting for range maps or odometry.
  size_t numWaiting() const { return assembler_->numWaiting(); }
  const FrameCounters& counters() const { return assembler_->counters(); }

 private:
  struct Camera;
  struct Observation {
    CameraObstacles obstacles;
    HeightPoints heights;
    cv::Mat reference;  // the image of the range map; may be empty
  };
  using Frame = AssembledFrame<Observation>;

  std::optional<RigidTransform> fixedFromVehicle(
      const std::optional<RigidTransform>& odom_from_vehicle) const;
  void process(Frame frame);
  void fuse(Frame* frame, const RigidTransform& fixed_from_vehicle);
  std::optional<RigidTransform> odomFromVehicle(Timestamp stamp) const;
  void settleImages(Timestamp until);
  void forgetUnwatched(Timestamp stamp, LocalObstacleMap* map) const;
  void setLiveness(const Camera& camera, ObstacleCameraStatus* status) const;
  void noteWithoutPose(const Frame& frame);
  void emit(const LocalObstacleMap& map, const StepMapper& steps,
            const std::vector<const CameraObstacles*>& cameras);
  void emitAt(Timestamp stamp);
  void moveTo(Timestamp stamp, const RigidTransform& fixed_from_vehicle, LocalObstacleMap* map) const;
  void emitWhenSilent();
  void updateStatus(Camera* camera, const CameraObstacles& seen) const;
  void startOver(DriveBreak drive_break, Timestamp stamp);

  const std::shared_ptr<const CameraRig> rig_;
  const ObstacleMapperOptions options_;
  const FrameCallback on_frame_;
  const PolarGrid grid_;
  std::vector<std::unique_ptr<Camera>> cameras_;  // indexed as in the rig; null if not in use
  std::unique_ptr<FrameAssembler<Observation>> assembler_;
  LocalObstacleMap map_;
  StepMapper steps_;
  const CorridorFinder corridor_finder_;
  const GapFinder gap_finder_;
  std::unique_ptr<PathCurvature> curvature_;
  std::unique_ptr<SilentCameras> silent_;
  std::unique_ptr<StandingWatch> standing_;
  std::unique_ptr<const HiddenGround> hidden_;
  size_t num_silent_emitted_ = 0;        // silent cameras at the last emitted frame
  std::optional<Timestamp> last_fused_;  // stamp of the last range maps in the map
  bool is_at_rest_ = false;              // whether the vehicle stood at that stamp
  Timestamp objects_stamp_;
  std::vector<TrackedObject> objects_;
  std::optional<Timestamp> last_emitted_;
  std::optional<Timestamp> last_heard_;  // odometry's stamp when the last range map arrived
  RigidTransform map_from_odom_, anchor_;
  bool has_anchor_ = false;
  uint64_t num_jumps_ = 0;
};

}  // namespace vcharge
