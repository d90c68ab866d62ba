#pragma once

#include <functional>
#include <optional>
#include <vector>

namespace vcharge {

/// Progress of a mover along its path: piecewise constant acceleration, so that the speed is continuous.
class SpeedSchedule {
 public:
  static constexpr double kStep_s = 0.5;

  struct Progress {
    double along_m, speed_m_per_s;
  };
  /// `steps` are kStep_s apart, the first at time 0.
  explicit SpeedSchedule(std::vector<Progress> steps) : steps_(std::move(steps)) {}

  /// Before the first and after the last step the mover stands.
  Progress at(double time_s) const;
  const std::vector<Progress>& steps() const { return steps_; }

 private:
  std::vector<Progress> steps_;
};

/// Task of planSchedule(). Speeds are multiples of max_speed / num_speeds; the speed changes by at most one
/// such multiple in a step.
struct ScheduleTask {
  double path_m = 0.0;
  double max_speed_m_per_s = 1.2;
  int num_speeds = 3;
  int num_steps = 1;
  double cell_m() const { return 0.5 * SpeedSchedule::kStep_s * max_speed_m_per_s / num_speeds; }
  double margin_m() const { return 0.5 * SpeedSchedule::kStep_s * max_speed_m_per_s; }

  /// Whether the mover may be there at a step, and how fast it may be there.
  std::function<bool(int step, double along_m)> is_free;
  std::function<double(double along_m)> speed_limit_m_per_s;
  /// Speed that the mover would like to have at a step.
  std::function<double(int step)> wanted_m_per_s;
};

/// Finds a schedule from the start of the path that keeps to free states at all steps, as close to the wanted
/// speeds as possible: a mover waits, or slows down early enough, wherever it must. Searches backwards for
/// the states from which there is a way until the last step. Nothing if there is none.
std::optional<SpeedSchedule> planSchedule(const ScheduleTask& task);

}  // namespace vcharge
