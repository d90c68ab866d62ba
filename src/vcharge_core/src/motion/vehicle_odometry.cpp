#include "vcharge_core/motion/vehicle_odometry.h"

#include <algorithm>

#include "vcharge_core/base/options.h"

namespace vcharge {
namespace {

/// A stamp this far before the newest entry means that a bag was restarted.
constexpr double kResetBackwards_s = 1.0;

}  // namespace

void fillVelocities(std::vector<VehicleOdometry>* poses) {
  for (size_t i = 0; i < poses->size(); ++i) {
    const VehicleOdometry& before = (*poses)[i == 0 ? 0 : i - 1];
    const VehicleOdometry& after = (*poses)[std::min(i + 1, poses->size() - 1)];
    if (!(before.stamp < after.stamp)) {
      continue;  // a single pose
    }
    const double time_s = toSeconds(after.stamp - before.stamp);
    VehicleOdometry& pose = (*poses)[i];
    const Eigen::Vector3d forward = pose.odom_from_vehicle.rotation() * Eigen::Vector3d::UnitX();
    const RigidTransform before_from_after = before.odom_from_vehicle.inverse() * after.odom_from_vehicle;
    pose.forward_speed_m_per_s =
        forward.dot(after.odom_from_vehicle.translation() - before.odom_from_vehicle.translation()) / time_s;
    pose.yaw_rate_rad_per_s = yawOfRotation(before_from_after.rotation()) / time_s;
  }
}

OdometryBuffer::OdometryBuffer(const OdometryBufferOptions& options) : options_(options) {
  options_.validate();
}

OdometryBuffer::AddResult OdometryBuffer::add(const VehicleOdometry& odometry) {
  AddResult result = AddResult::kAdded;
  if (!entries_.empty()) {
    const Timestamp newest = entries_.back().stamp;
    if (odometry.stamp <= newest) {
      if (toSeconds(newest - odometry.stamp) >= kResetBackwards_s) {
        entries_.clear();
        ++counts_.resets;
        result = AddResult::kReset;
      } else {
        const auto entry =
            std::lower_bound(entries_.begin(), entries_.end(), odometry.stamp,
                             [](const VehicleOdometry& left, Timestamp stamp) { return left.stamp < stamp; });
        if (entry == entries_.end() || entry->stamp != odometry.stamp) {
          ++counts_.out_of_order;
          return AddResult::kOutOfOrder;
        }
        *entry = odometry;
        ++counts_.corrections;
        return AddResult::kCorrected;
      }
    } else if (toSeconds(odometry.stamp - newest) > options_.max_gap_s) {
      ++counts_.gaps;
      result = AddResult::kAddedAfterGap;
    }
  }
  entries_.push_back(odometry);
  ++counts_.added;
  while (toSeconds(odometry.stamp - entries_.front().stamp) > options_.history_s) {
    entries_.pop_front();
  }
  return result;
}

OdometryBuffer::Lookup OdometryBuffer::lookup(Timestamp stamp) const {
  Lookup result;
  if (entries_.empty()) {
    result.status = LookupStatus::kEmpty;
    return result;
  }
  const auto after =
      std::lower_bound(entries_.begin(), entries_.end(), stamp,
                       [](const VehicleOdometry& left, Timestamp right) { return left.stamp < right; });
  if (after == entries_.end()) {
    result.status = LookupStatus::kAfterLast;
    return result;
  }
  if (after->stamp == stamp) {
    result.status = LookupStatus::kOk;
    result.odometry = *after;
    return result;
  }
  if (after == entries_.begin()) {
    result.status = LookupStatus::kBeforeFirst;
    return result;
  }
  const VehicleOdometry& before = *(after - 1);
  const double interval_s = toSeconds(after->stamp - before.stamp);
  if (interval_s > options_.max_gap_s) {
    result.status = LookupStatus::kInGap;
    return result;
  }
  const double fraction = toSeconds(stamp - before.stamp) / interval_s;
  result.status = LookupStatus::kOk;
  result.odometry.stamp = stamp;
  result.odometry.odom_from_vehicle =
      interpolate(before.odom_from_vehicle, after->odom_from_vehicle, fraction);
  result.odometry.forward_speed_m_per_s =
      (1.0 - fraction) * before.forward_speed_m_per_s + fraction * after->forward_speed_m_per_s;
  result.odometry.yaw_rate_rad_per_s =
      (1.0 - fraction) * before.yaw_rate_rad_per_s + fraction * after->yaw_rate_rad_per_s;
  return result;
}

std::optional<Timestamp> OdometryBuffer::newestStamp() const {
  if (entries_.empty()) {
    return std::nullopt;
  }
  return entries_.back().stamp;
}

std::string describe(OdometryBuffer::LookupStatus status) {
  switch (status) {
    case OdometryBuffer::LookupStatus::kOk:
      return "ok";
    case OdometryBuffer::LookupStatus::kEmpty:
      return "no odometry yet";
    case OdometryBuffer::LookupStatus::kBeforeFirst:
      return "before the first odometry";
    case OdometryBuffer::LookupStatus::kAfterLast:
      return "after the last odometry";
    case OdometryBuffer::LookupStatus::kInGap:
      return "inside a gap of the odometry";
  }
  return "unknown";
}

}  // namespace vcharge
