#include "scenes/movers/ways/speed_schedule.h"

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <cstdlib>

namespace vcharge {

SpeedSchedule::Progress SpeedSchedule::at(double time_s) const {
  const double end_s = kStep_s * static_cast<double>(steps_.size() - 1);
  if (time_s <= 0.0 || time_s >= end_s) {
    const Progress& last = time_s <= 0.0 ? steps_.front() : steps_.back();
    return {last.along_m, time_s < 0.0 || time_s > end_s ? 0.0 : last.speed_m_per_s};
  }
  const auto step = std::min(static_cast<size_t>(time_s / kStep_s), steps_.size() - 2);
  const double in_step_s = time_s - kStep_s * static_cast<double>(step);
  const Progress& from = steps_[step];
  const double acceleration = (steps_[step + 1].speed_m_per_s - from.speed_m_per_s) / kStep_s;
  return {from.along_m + in_step_s * (from.speed_m_per_s + 0.5 * acceleration * in_step_s),
          from.speed_m_per_s + acceleration * in_step_s};
}

std::optional<SpeedSchedule> planSchedule(const ScheduleTask& task) {
  const double cell_m = task.cell_m();
  const int speeds = task.num_speeds + 1;
  const int cells =
      1 + std::min(static_cast<int>(std::floor(task.path_m / cell_m)), 2 * task.num_speeds * task.num_steps);
  const double unit_m_per_s = task.max_speed_m_per_s / task.num_speeds;
  std::vector<int> fastest(static_cast<size_t>(cells));
  for (int cell = 0; cell < cells; ++cell) {
    fastest[static_cast<size_t>(cell)] =
        static_cast<int>(std::floor(task.speed_limit_m_per_s(cell * cell_m) / unit_m_per_s + 1e-9));
  }
  // From a lasting state there is a way to the last step.
  std::vector<uint8_t> lasting(static_cast<size_t>(task.num_steps + 1) * static_cast<size_t>(cells) *
                               static_cast<size_t>(speeds));
  const auto lasts = [&](int step, int cell, int speed) -> uint8_t& {
    return lasting[(static_cast<size_t>(step) * static_cast<size_t>(cells) + static_cast<size_t>(cell)) *
                       static_cast<size_t>(speeds) +
                   static_cast<size_t>(speed)];
  };
  for (int step = task.num_steps; step >= 0; --step) {
    const int reached = std::min(cells, 1 + 2 * task.num_speeds * step);
    for (int cell = 0; cell < reached; ++cell) {
      if (!task.is_free(step, cell * cell_m)) {
        continue;
      }
      for (int speed = 0; speed < speeds && speed <= fastest[static_cast<size_t>(cell)]; ++speed) {
        bool found = step == task.num_steps;
        for (int next = std::max(0, speed - 1); !found && next <= std::min(speeds - 1, speed + 1); ++next) {
          found = cell + speed + next < cells && lasts(step + 1, cell + speed + next, next) != 0;
        }
        lasts(step, cell, speed) = found ? 1 : 0;
      }
    }
  }
  std::vector<SpeedSchedule::Progress> steps;
  int cell = 0;
  int speed = -1;
  for (int step = 0; step <= task.num_steps; ++step) {
    const int wanted = static_cast<int>(std::lround(task.wanted_m_per_s(step) / unit_m_per_s));
    const int lowest = step == 0 ? 0 : std::max(0, speed - 1);
    const int highest = step == 0 ? speeds - 1 : std::min(speeds - 1, speed + 1);
    int best = -1;
    for (int next = lowest; next <= highest; ++next) {
      const int next_cell = step == 0 ? cell : cell + speed + next;
      if (next_cell < cells && lasts(step, next_cell, next) != 0 &&
          (best < 0 || std::abs(next - wanted) < std::abs(best - wanted))) {
        best = next;
      }
    }
    if (best < 0) {
      return std::nullopt;
    }
    cell = step == 0 ? cell : cell + speed + best;
    speed = best;
    steps.push_back({cell * cell_m, speed * unit_m_per_s});
  }
  return SpeedSchedule(std::move(steps));
}

}  // namespace vcharge
