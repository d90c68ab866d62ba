#include <algorithm>
#include <cmath>

#include "vcharge_wheel_odometry/wheel_odometry.h"

namespace vcharge {

OdometryStream::OdometryStream(double hold_s, double max_extrapolation_s)
    : hold_(durationFromSeconds(hold_s)), max_extrapolation_(durationFromSeconds(max_extrapolation_s)) {}

OdometryStream OdometryStream::forFrameRate(double frame_rate_hz) {
  // An estimate waits for the next trigger, which may be late by half a period.
  return OdometryStream(1.5 / frame_rate_hz, 0.1);
}

std::vector<OdometryEstimate> OdometryStream::flush() {
  std::vector<OdometryEstimate> ready;
  if (!history_.empty()) {
    release(history_.back().odometry.stamp + Duration(1), &ready);
  }
  history_.clear();
  extrapolated_.reset();
  return ready;
}

void OdometryStream::release(Timestamp before, std::vector<OdometryEstimate>* ready) {
  for (const OdometryEstimate& each : history_) {
    if (each.odometry.stamp < before && (!published_ || *published_ < each.odometry.stamp)) {
      ready->push_back(each);
      published_ = each.odometry.stamp;
    }
  }
}

std::vector<OdometryEstimate> OdometryStream::add(const OdometryEstimate& estimate) {
  std::vector<OdometryEstimate> ready;
  if (!history_.empty() && estimate.odometry.stamp <= history_.back().odometry.stamp) {
    return ready;
  }
  history_.push_back(estimate);
  if (extrapolated_ && *extrapolated_ <= estimate.odometry.stamp) {
    const std::optional<OdometryEstimate> corrected = at(*extrapolated_);
    // After a gap in the ticks a correction comes too late to be sorted by those who read it.
    if (corrected && estimate.odometry.stamp - *extrapolated_ <= hold_) {
      ready.push_back(*corrected);
    }
    extrapolated_.reset();
  }
  release(estimate.odometry.stamp - hold_, &ready);
  while (toSeconds(estimate.odometry.stamp - history_.front().odometry.stamp) > 1.0) {
    history_.pop_front();
  }
  return ready;
}

std::optional<OdometryEstimate> OdometryStream::at(Timestamp stamp) const {
  const auto after = std::find_if(history_.begin(), history_.end(),
                                  [&](const OdometryEstimate& each) { return stamp <= each.odometry.stamp; });
  if (after != history_.end() && after->odometry.stamp == stamp) {
    return *after;
  }
  if (after == history_.begin()) {
    return std::nullopt;
  }
  OdometryEstimate result = *(after - 1);
  const VehicleOdometry& from = (after - 1)->odometry;
  const double since_s = toSeconds(stamp - from.stamp);
  result.odometry.stamp = stamp;
  if (after == history_.end()) {
    if (stamp - from.stamp > max_extrapolation_) {
      return std::nullopt;
    }
    result.odometry.odom_from_vehicle =
        from.odom_from_vehicle *
        arcMotion(from.forward_speed_m_per_s * since_s, from.yaw_rate_rad_per_s * since_s);
    return result;
  }
  const VehicleOdometry& to = after->odometry;
  const double fraction = since_s / toSeconds(to.stamp - from.stamp);
  result.odometry.odom_from_vehicle = interpolate(from.odom_from_vehicle, to.odom_from_vehicle, fraction);
  result.odometry.forward_speed_m_per_s += fraction * (to.forward_speed_m_per_s - from.forward_speed_m_per_s);
  result.odometry.yaw_rate_rad_per_s += fraction * (to.yaw_rate_rad_per_s - from.yaw_rate_rad_per_s);
  return result;
}

std::vector<OdometryEstimate> OdometryStream::trigger(Timestamp stamp) {
  std::vector<OdometryEstimate> ready;
  release(stamp, &ready);
  if (!published_ || *published_ < stamp) {
    if (const std::optional<OdometryEstimate> estimate = at(stamp)) {
      ready.push_back(*estimate);
      published_ = stamp;
      if (history_.back().odometry.stamp < stamp) {
        extrapolated_ = stamp;
      }
    }
  }
  return ready;
}

}  // namespace vcharge
