#pragma once

#include <cstdint>
#include <deque>
#include <functional>
#include <map>
#include <memory>
#include <optional>
#include <utility>
#include <vector>

#include <opencv2/core.hpp>

#include "vcharge_core/camera/camera_rig.h"
#include "vcharge_core/camera/working_camera.h"
#include "vcharge_core/motion/vehicle_odometry.h"
#include "vcharge_obstacles/ground_watch.h"
#include "vcharge_obstacles/local_obstacle_map.h"

namespace vcharge {

/// Watches the ground while the vehicle stands and gets no range maps, or only where cameras overlap: the map
/// keeps what it holds, except where images tell that something has changed. What changes there becomes
/// unknown, and stays so until it is measured again, or until the ground looks as it did before. The result
/// depends on stamps only, not on the order in which images, range maps and odometry arrive. Not thread safe.
class StandingWatch {
 public:
  using Pixels = std::function<cv::Mat()>;
  using OdometryAt = std::function<std::optional<VehicleOdometry>(Timestamp)>;

  /// Ground beyond max_distance_m from a camera is not watched.
  StandingWatch(std::shared_ptr<const CameraRig> rig, const PolarGrid& grid, double max_distance_m,
                const GroundWatchOptions& options);
  ~StandingWatch();

  /// Watches a camera from now on, in images of this kind. Before its first range map, it has freed nothing.
  void setCamera(size_t camera, const WorkingCamera& working);
  /// Adds an image of the sensor. `pixels` gives it (CV_8UC1), and is called if it is compared.
  void addImage(size_t camera, Timestamp stamp, const Pixels& pixels);
  /// Compares the images up to a stamp that the odometry has reached. std::logic_error for another size than
  /// the rig's.
  void settle(Timestamp until, const OdometryAt& odometry_at);
  /// Makes unknown what has changed up to a stamp, and free again what looks as it did when it was free.
  void apply(Timestamp until, const RigidTransform& fixed_from_odom, LocalObstacleMap* map) const;
  /// Drops the changes up to a stamp: they are in the map.
  void dropChanges(Timestamp until);
  /// The poses have jumped, or the drive starts again.
  void clear();

 private:
  struct Camera;
  struct Change {
    Timestamp first, last;
  };

  void compare(Camera* camera, Timestamp stamp, const cv::Mat& pixels,
               const RigidTransform& odom_from_vehicle);
  void forgetChanged(Timestamp until, const RigidTransform& fixed_from_odom, LocalObstacleMap* map) const;
  void restoreUnchanged(Timestamp until, LocalObstacleMap* map) const;

  const std::shared_ptr<const CameraRig> rig_;
  const PolarGrid grid_;
  const double max_distance_m_;
  const GroundWatchOptions options_;
  std::vector<std::unique_ptr<Camera>> cameras_;  // indexed as in the rig; null before its first range map
  std::map<std::pair<int64_t, int64_t>, Change> changes_;  // key: point in odom, in steps of 0.1 m
};

}  // namespace vcharge
