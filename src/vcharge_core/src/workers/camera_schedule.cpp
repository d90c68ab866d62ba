#include "vcharge_core/workers/camera_schedule.h"

#include <sys/resource.h>

#include <ctime>

#include <algorithm>
#include <cmath>

#include "vcharge_core/base/error.h"

namespace vcharge {
namespace {

// Speed from which the direction of travel counts in full.
constexpr double kFullSpeed_m_per_s = 0.5;
// Objects up to this distance from a camera, and within this angle about its axis, make it more urgent.
constexpr double kNearObject_m = 8.0, kObjectCosine = 0.5;
// A camera that had no turn for long does not claim all that it missed.
constexpr double kLargestClaim = 2.0;
// Weight of the newest value in a mean, and time constant of the use and of "lately".
constexpr double kNewest = 0.1, kMean_s = 2.0;
// Part of the time between stamps in which turns must end.
constexpr double kPartOfStep = 0.9;
// The shortest of so many times between stamps is that of the cameras.
constexpr size_t kNumSteps = 10;
// A longer time between stamps is an interruption, in which nothing is saved up.
constexpr double kMaxStep_s = 1.0;

void average(double value, double* mean) {
  *mean += *mean > 0.0 ? kNewest * (value - *mean) : value;
}

}  // namespace

double threadProcessorTime_s() {
  timespec time{};
  clock_gettime(CLOCK_THREAD_CPUTIME_ID, &time);
  return static_cast<double>(time.tv_sec) + 1e-9 * static_cast<double>(time.tv_nsec);
}

void letOthersGoFirst() {
  constexpr int kNice = 5;              // a third of the weight of other threads
  setpriority(PRIO_PROCESS, 0, kNice);  // of the thread, in Linux
}

CameraSchedule::CameraSchedule(const CameraRig& rig, double budget_s_per_s, size_t num_threads)
    : budget_s_per_s_(budget_s_per_s), num_threads_(num_threads), credit_s_(budget_s_per_s * kReserve_s) {
  check(budget_s_per_s >= 0.0 && num_threads > 0,
        "CameraSchedule: expected a budget of at least 0, and threads");
  for (const RigCamera& camera : rig.cameras) {
    Camera& added = cameras_.emplace_back();
    if (camera.vehicle_from_camera) {
      const Eigen::Vector3d axis = camera.vehicle_from_camera->rotation() * Eigen::Vector3d::UnitZ();
      added.position_m = camera.vehicle_from_camera->translation().head<2>();
      if (axis.head<2>().norm() > 1e-3) {
        added.axis = axis.head<2>().normalized();
      }
    }
  }
}

void CameraSchedule::passTime(Timestamp stamp) {
  const double step_s = now_ ? toSeconds(stamp - *now_) : 0.0;
  now_ = stamp;
  if (step_s < 0.0 || step_s > kMaxStep_s) {  // a replay, or an interruption
    for (Camera& camera : cameras_) {
      camera.claim = 0.0;
    }
    credit_s_ = budget_s_per_s_ * kReserve_s;
    used_s_per_s_ = 0.0;
    last_short_.reset();
    last_turn_.reset();
    return;
  }
  if (step_s > 0.0) {
    steps_s_.push_back(step_s);
    if (steps_s_.size() > kNumSteps) {
      steps_s_.pop_front();
    }
  }
  credit_s_ = std::min(credit_s_ + budget_s_per_s_ * step_s, budget_s_per_s_ * kReserve_s);
  used_s_per_s_ *= std::exp(-step_s / kMean_s);
}

double CameraSchedule::weightOf(const Camera& camera, const Eigen::Vector3d& velocity) {
  double weight = 1.0 + (camera.sees_object ? 1.0 : 0.0);
  if (camera.axis) {
    const Eigen::Vector2d moves =
        velocity.head<2>() + velocity.z() * Eigen::Vector2d(-camera.position_m->y(), camera.position_m->x());
    weight += std::max(0.0, camera.axis->dot(moves)) / std::max(kFullSpeed_m_per_s, moves.norm());
  }
  return weight;
}

/// One turn more may begin as long as time is left: what it overdraws is paid back.
size_t CameraSchedule::affordableTurns() const {
  // Stamps that are dropped because turns take too long must not leave more time for turns.
  const double step_s = steps_s_.empty() ? 0.0 : *std::min_element(steps_s_.begin(), steps_s_.end());
  size_t turns = 0;
  for (double left_s = credit_s_; left_s > 0.0 && turns < cameras_.size(); left_s -= turn_s_) {
    const size_t before_it = turns / num_threads_;  // in the same thread
    if (before_it > 0 && static_cast<double>(before_it + 1) * turn_passed_s_ > kPartOfStep * step_s) {
      break;
    }
    ++turns;
  }
  return turns;
}

/// Shares the turns out in proportion to the weights (smooth weighted round robin).
void CameraSchedule::share(const std::vector<size_t>& candidates, size_t num_turns,
                           const Eigen::Vector3d& velocity) {
  std::vector<double> weights;
  double sum = 0.0;
  for (const size_t camera : candidates) {
    weights.push_back(weightOf(cameras_[camera], velocity));
    sum += weights.back();
  }
  for (size_t i = 0; i < candidates.size(); ++i) {
    double& claim = cameras_[candidates[i]].claim;
    claim = std::min(kLargestClaim, claim + static_cast<double>(num_turns) * weights[i] / sum);
  }
}

std::vector<size_t> CameraSchedule::choose(Timestamp stamp, const std::vector<bool>& candidates,
                                           const Eigen::Vector3d& velocity) {
  const std::lock_guard<std::mutex> lock(mutex_);
  check(candidates.size() == cameras_.size(), "CameraSchedule::choose: expected one candidate per camera");
  passTime(stamp);
  std::vector<size_t> chosen;
  for (size_t i = 0; i < cameras_.size(); ++i) {
    if (candidates[i]) {
      chosen.push_back(i);
    }
  }
  const bool must_begin = !last_turn_ || toSeconds(stamp - *last_turn_) >= kLongestPause_s;
  const size_t affordable = hasLimit() ? std::max(affordableTurns(), size_t{must_begin}) : chosen.size();
  const size_t num_turns = std::min(chosen.size(), affordable);
  if (num_turns > 0) {
    last_turn_ = stamp;
  }
  share(chosen, num_turns, velocity);
  std::stable_sort(chosen.begin(), chosen.end(),
                   [&](size_t a, size_t b) { return cameras_[a].claim > cameras_[b].claim; });
  for (size_t i = num_turns; i < chosen.size(); ++i) {
    ++cameras_[chosen[i]].left_out;
    last_short_ = stamp;
  }
  chosen.resize(num_turns);
  for (const size_t camera : chosen) {
    cameras_[camera].claim -= 1.0;
  }
  return chosen;
}

void CameraSchedule::spend(double processor_s, double passed_s, size_t num_turns) {
  const std::lock_guard<std::mutex> lock(mutex_);
  credit_s_ -= processor_s;
  used_s_per_s_ += processor_s / kMean_s;
  for (size_t i = 0; i < num_turns; ++i) {
    average(processor_s / static_cast<double>(num_turns), &turn_s_);
    average(passed_s / static_cast<double>(num_turns), &turn_passed_s_);
  }
}

void CameraSchedule::setObjects(const std::vector<Eigen::Vector2d>& in_vehicle_m) {
  const std::lock_guard<std::mutex> lock(mutex_);
  for (Camera& camera : cameras_) {
    camera.sees_object =
        camera.axis && std::any_of(in_vehicle_m.begin(), in_vehicle_m.end(), [&](const Eigen::Vector2d& at) {
          const Eigen::Vector2d to_object = at - *camera.position_m;
          return to_object.norm() < kNearObject_m &&
                 to_object.dot(*camera.axis) > kObjectCosine * to_object.norm();
        });
  }
}

CameraSchedule::Status CameraSchedule::status() const {
  const std::lock_guard<std::mutex> lock(mutex_);
  Status status{budget_s_per_s_, used_s_per_s_, {}, false};
  for (const Camera& camera : cameras_) {
    status.left_out.push_back(camera.left_out);
  }
  status.is_short = last_short_ && now_ && toSeconds(*now_ - *last_short_) < kMean_s;
  return status;
}

}  // namespace vcharge
