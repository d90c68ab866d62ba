#pragma once

#include <algorithm>
#include <cmath>
#include <string>

#include "vcharge_core/base/error.h"
#include "vcharge_core/base/text_format.h"
#include "vcharge_core/dense_maps/parking_bay_file.h"
#include "vcharge_core/files/file_io.h"
#include "vcharge_core/motion/trajectory.h"
#include "vcharge_obstacles/bay_monitor.h"
#include "vcharge_obstacles/obstacle_mapper.h"

namespace vcharge {

inline constexpr const char* kGapColumns =
    "stamp_ns,vehicle_x_m,vehicle_y_m,vehicle_yaw_rad,kind,x0_m,y0_m,x1_m,y1_m,x2_m,y2_m,x3_m,y3_m,length_m,"
    "length_sigma_m,depth_m\n";

/// Rows of gaps.csv: the gaps of one map, with pose and corners in its fixed frame.
inline std::string gapRows(const ObstacleFrame& frame) {
  std::string rows;
  for (const ParkingGap& gap : frame.gaps) {
    const RigidTransform& pose = frame.map.fixed_from_vehicle;
    const Eigen::Vector3d axis = pose.rotation() * Eigen::Vector3d::UnitX();
    rows += std::to_string(frame.map.stamp.nanoseconds()) + "," + toText(pose.translation().x(), 3) + "," +
            toText(pose.translation().y(), 3) + "," + toText(std::atan2(axis.y(), axis.x()), 5) +
            (gap.kind == BayKind::kParallel ? ",parallel" : ",perpendicular");
    for (const Eigen::Vector2d& corner_m : gap.corners_m) {
      rows += "," + toText(corner_m.x(), 3) + "," + toText(corner_m.y(), 3);
    }
    rows += "," + toText(gap.length_m, 3) + "," + toText(gap.length_sigma_m, 3) + "," +
            toText(gap.depth_m, 3) + "\n";
  }
  return rows;
}

/// Monitors the bays of a map during a recorded drive whose trajectory in that map is known.
class BayRecorder {
 public:
  BayRecorder(const std::string& bays_path, const std::string& trajectory_path)
      : bays_(readParkingBays(bays_path)), trajectory_(readTrajectory(trajectory_path)), monitor_(bays_) {}

  void add(const ObstacleMap& map) {
    const auto pose = std::lower_bound(
        trajectory_.begin(), trajectory_.end(), map.stamp,
        [](const StampedTransform& candidate, Timestamp stamp) { return candidate.stamp < stamp; });
    if (pose == trajectory_.end() || pose->stamp != map.stamp) {
      return;  // not localized
    }
    monitor_.add(map, pose->world_from_vehicle * map.fixed_from_vehicle.inverse());
    ++num_maps_;
  }

  /// Writes bays.yaml and bays.csv (id, state, seconds since when it was observed in that state, and last).
  /// InputError if the vehicle was never localized.
  void finish(const std::string& trajectory_path, const std::string& folder) {
    if (num_maps_ == 0) {
      throw InputError(trajectory_path + ": expected poses at the stamps of the images");
    }
    std::string table = "id,state,since_s,observed_s\n";
    bays_.bays.clear();
    for (const MonitoredBay& bay : monitor_.bays()) {
      bays_.bays.push_back(bay.bay);
      table += std::to_string(bay.bay.id) + "," + nameOf(bay.bay.state) + "," +
               (bay.since ? toString(*bay.since) : "") + "," + (bay.observed ? toString(*bay.observed) : "") +
               "\n";
    }
    writeParkingBays(bays_, folder + "/bays.yaml");
    writeTextFileAtomically(folder + "/bays.csv", table);
  }

 private:
  ParkingBays bays_;
  const Trajectory trajectory_;
  BayMonitor monitor_;
  size_t num_maps_ = 0;
};

}  // namespace vcharge
