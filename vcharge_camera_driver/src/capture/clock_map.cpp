#include "vcharge_camera_driver/clock_map.h"

#include <ctime>

#include <algorithm>

namespace vcharge {
namespace {

constexpr int kReadings = 5;

Timestamp read(clockid_t clock) {
  timespec now{};
  clock_gettime(clock, &now);
  return Timestamp::fromNanoseconds(int64_t{1000000000} * now.tv_sec + now.tv_nsec);
}

}  // namespace

Timestamp monotonicNow() {
  return read(CLOCK_MONOTONIC);
}
Timestamp systemNow() {
  return read(CLOCK_REALTIME);
}

ClockMap::ClockMap(Clock drive_clock, Clock monotonic)
    : drive_clock_(std::move(drive_clock)), monotonic_(monotonic ? std::move(monotonic) : monotonicNow) {
  offset_ = measure();
}

Duration ClockMap::measure() {
  Duration best_width = Duration::max();
  Duration best{0};
  for (int i = 0; i < kReadings; ++i) {
    const Timestamp before = monotonic_();
    const Timestamp drive = drive_clock_();
    const Timestamp after = monotonic_();
    if (after - before < best_width) {
      best_width = after - before;
      best = drive - (before + (after - before) / 2);
      last_update_ = after;
    }
  }
  return best;
}

void ClockMap::update() {
  const Timestamp before = last_update_;
  const Duration change = measure() - offset_;
  if (std::chrono::abs(change) > durationFromSeconds(kStep_s)) {
    offset_ += change;
    ++num_steps_;
    return;
  }
  const Duration most = durationFromSeconds(kMaxSlew * toSeconds(last_update_ - before));
  offset_ += std::clamp(change, -most, most);
}

}  // namespace vcharge
