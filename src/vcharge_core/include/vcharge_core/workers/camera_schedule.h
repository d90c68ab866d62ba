#pragma once

#include <cstddef>
#include <cstdint>
#include <deque>
#include <mutex>
#include <optional>
#include <vector>

#include <Eigen/Core>

#include "vcharge_core/base/timestamp.h"
#include "vcharge_core/camera/camera_rig.h"

namespace vcharge {

/// Processor time of the calling thread, in seconds.
double threadProcessorTime_s();

/// Gives the calling thread, and those that it starts, a third of the weight of other threads. Without effect
/// where the system does not allow it.
void letOthersGoFirst();

/// Decides which cameras a stage works on at a stamp if it may not use the processor for all of them. They
/// take turns: a camera that looks where it is going (by speed, gear and turn) has up to two turns while
/// others have one, and one more if it sees something that moves nearby. Work is measured in processor
/// seconds per second of the drive, and the budget is held on average: time that was not used is kept for
/// kReserve_s, and overdrawn time is paid back. There are no more turns at a stamp than end before the next
/// one if `num_threads` threads take them, so that results come at every stamp, and soon. Thread safe.
class CameraSchedule {
 public:
  static constexpr double kReserve_s = 0.2, kLongestPause_s = 0.4;

  /// Cameras without extrinsics look nowhere in particular. `budget_s_per_s`: 0 without a limit.
  CameraSchedule(const CameraRig& rig, double budget_s_per_s, size_t num_threads = 1);

  bool hasLimit() const { return budget_s_per_s_ > 0.0; }
  size_t numThreads() const { return num_threads_; }

  /// The cameras of the candidates (one per camera of the rig) that get a turn, the most urgent first.
  /// `velocity`: forward (m/s), to the left (m/s) and turn (rad/s) of the vehicle.
  std::vector<size_t> choose(Timestamp stamp, const std::vector<bool>& candidates,
                             const Eigen::Vector3d& velocity);
  /// Counts processor time, and the time that passed meanwhile. `num_turns`: cameras that it was used for; 0
  /// for work on all of them.
  void spend(double processor_s, double passed_s, size_t num_turns);
  /// Positions of what moves, in the vehicle's frame.
  void setObjects(const std::vector<Eigen::Vector2d>& in_vehicle_m);

  struct Status {
    double budget_s_per_s = 0.0, used_s_per_s = 0.0;  ///< the latter over the last seconds
    std::vector<uint64_t> left_out;                   ///< per camera: stamps without a turn
    bool is_short = false;                            ///< cameras were left out lately
  };
  Status status() const;

 private:
  struct Camera {
    std::optional<Eigen::Vector2d> position_m, axis;  // in the vehicle's frame; axis of unit length
    double claim = 0.0;                               // turns that are due
    uint64_t left_out = 0;
    bool sees_object = false;
  };
  static double weightOf(const Camera& camera, const Eigen::Vector3d& velocity);
  void share(const std::vector<size_t>& candidates, size_t num_turns, const Eigen::Vector3d& velocity);
  size_t affordableTurns() const;
  void passTime(Timestamp stamp);

  const double budget_s_per_s_;
  const size_t num_threads_;
  mutable std::mutex mutex_;
  std::vector<Camera> cameras_;
  std::optional<Timestamp> now_;
  double credit_s_;
  double turn_s_ = 0.0;         // mean processor time of a turn
  double turn_passed_s_ = 0.0;  // mean duration of a turn
  std::deque<double> steps_s_;  // the latest times between stamps
  double used_s_per_s_ = 0.0;   // with exponentially decreasing weights
  std::optional<Timestamp> last_short_, last_turn_;
};

}  // namespace vcharge
