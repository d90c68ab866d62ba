#pragma once

#include <cstddef>
#include <functional>
#include <mutex>
#include <optional>
#include <string>
#include <type_traits>
#include <vector>

#include <vcharge_msgs/TrackedObjects.h>

#include "vcharge_core/camera/camera_rig.h"
#include "vcharge_core/motion/vehicle_odometry.h"
#include "vcharge_core/workers/camera_schedule.h"
#include "vcharge_ros/drive_monitor.h"

namespace vcharge {

/// Keeps a nodelet within its parameter ~processor_budget, processor seconds per second: with a limit, its
/// work runs in the threads that call run(), one each, or in those of runTurns(), and CameraSchedule decides
/// which cameras it is done for. 0: no limit, and as many threads as there are processors. Thread safe.
class StageSchedule {
 public:
  /// `num_threads`: of runTurns().
  StageSchedule(const CameraRig& rig, double budget_s_per_s, size_t num_threads = 1);

  bool hasLimit() const { return schedule_.hasLimit(); }
  /// Motion of the vehicle, for choose().
  void setOdometry(const VehicleOdometry& odometry);
  /// What moves, in `odom`.
  void setObjects(const vcharge_msgs::TrackedObjects& objects);
  /// With a limit, the calling thread and those of runTurns() let other stages go first from now on: what is
  /// farther along the chain of stages is not held up by newer work. Not for threads of the nodelet manager.
  void letResultsGoFirst() const;
  /// See CameraSchedule::choose().
  std::vector<size_t> choose(Timestamp stamp, const std::vector<bool>& candidates);
  /// Does work and counts its processor time, see CameraSchedule::spend(). `work` may return a number of
  /// turns.
  template <class Work>
  void run(const Work& work) {
    runAndCount([&]() -> size_t {
      if constexpr (std::is_void_v<std::invoke_result_t<Work>>) {
        work();
        return 0;
      } else {
        return static_cast<size_t>(work());
      }
    });
  }
  /// run() for each of the chosen cameras, the first ones first, in `num_threads` threads at once.
  void runTurns(const std::vector<size_t>& cameras, const std::function<void(size_t camera)>& work);
  /// Adds budget, use, and the stamps at which a camera, or each camera of the rig, was left out; warns if
  /// that happened lately.
  void describe(size_t camera, DriveMonitor::Report* report) const;
  void describe(const CameraRig& rig, DriveMonitor::Report* report) const;

 private:
  void runAndCount(const std::function<size_t()>& work);
  void describe(const CameraSchedule::Status& status, DriveMonitor::Report* report) const;

  CameraSchedule schedule_;
  std::mutex mutex_;
  std::optional<VehicleOdometry> odometry_;
};

}  // namespace vcharge
