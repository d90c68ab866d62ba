#include "vcharge_core/frames/drive_odometry.h"

#include <cmath>
#include <limits>
#include <numeric>
#include <vector>

namespace vcharge {
namespace {

constexpr double kReplay_s = 1.0;  // a smaller step back is a message that is out of order
constexpr double kSlack_m = 0.1;   // jitter of stamps makes short steps seem fast
constexpr double kHistory_s = 60.0;
constexpr double kPatientHistory_s = 3600.0;  // history kept if frames may come very late

Eigen::Vector3d planarStep(const VehicleOdometry& from, const VehicleOdometry& to) {
  const RigidTransform& start = from.odom_from_vehicle;
  const RigidTransform& end = to.odom_from_vehicle;
  const double turn_rad =
      std::remainder(yawOfRotation(end.rotation()) - yawOfRotation(start.rotation()), 2.0 * M_PI);
  return {end.translation().x() - start.translation().x(), end.translation().y() - start.translation().y(),
          turn_rad};
}

OdometryBufferOptions bufferOptions(const FrameAssemblerOptions& options) {
  OdometryBufferOptions buffer;
  buffer.max_gap_s = options.max_odometry_gap_s;
  buffer.history_s = options.waitsForEverything() ? kPatientHistory_s : kHistory_s;
  return buffer;
}

}  // namespace

FrameAssemblerOptions FrameAssemblerOptions::waiting(double max_camera_wait_s, double max_odometry_wait_s) {
  FrameAssemblerOptions options;
  options.max_camera_wait_s = max_camera_wait_s;
  options.max_odometry_wait_s = max_odometry_wait_s;
  return options;
}

int64_t FrameCounters::numLateImages() const {
  return std::accumulate(late_images.begin(), late_images.end(), int64_t{0});
}

std::vector<std::pair<std::string, int64_t>> FrameCounters::named() const {
  return {{"frames", frames},
          {"incomplete_frames", incomplete_frames},
          {"frames_without_odometry", frames_without_odometry},
          {"late_images", numLateImages()},
          {"odometry_gaps", odometry_gaps},
          {"odometry_resets", odometry_resets},
          {"ignored_odometry", ignored_odometry},
          {"odometry_corrections", odometry_corrections},
          {"replays", replays}};
}

std::string describe(DriveBreak drive_break) {
  switch (drive_break) {
    case DriveBreak::kOdometryGap:
      return "gap in the odometry";
    case DriveBreak::kOdometryReset:
      return "the odometry jumped";
    case DriveBreak::kReplay:
      break;
  }
  return "stamps jumped back";
}

DriveOdometry::DriveOdometry(const FrameAssemblerOptions& options)
    : options_((options.validate(), options)), buffer_options_(bufferOptions(options)) {
  clear();
}

void DriveOdometry::clear() {
  raw_ = raw_before_reset_ = bridged_ = OdometryBuffer(buffer_options_);
  bridged_from_odom_ = RigidTransform();
  last_.reset();
  velocity_.reset();
}

void DriveOdometry::setTrajectory(const Trajectory& odom_from_vehicle) {
  buffer_options_.history_s = std::numeric_limits<double>::infinity();
  clear();
  std::vector<VehicleOdometry> poses;
  for (const StampedTransform& stamped : odom_from_vehicle) {
    poses.push_back({stamped.stamp, stamped.world_from_vehicle});
  }
  fillVelocities(&poses);
  for (const VehicleOdometry& odometry : poses) {
    raw_.add(odometry);
    bridged_.add(odometry);
  }
  is_given_ = true;
}

bool DriveOdometry::jumpsBack(Timestamp stamp) const {
  return !is_given_ && last_ && toSeconds(last_->stamp - stamp) > kReplay_s;
}

bool DriveOdometry::isReset(const VehicleOdometry& odometry) const {
  const double period_s = toSeconds(odometry.stamp - last_->stamp);
  const RigidTransform motion = last_->odom_from_vehicle.inverse() * odometry.odom_from_vehicle;
  if (motion.translation().norm() > options_.max_speed_m_per_s * period_s + kSlack_m) {
    return true;
  }
  if (!velocity_ || period_s > options_.max_odometry_gap_s) {
    return false;
  }
  // A car's speed changes little between two messages.
  const Eigen::Vector3d change = planarStep(*last_, odometry) - *velocity_ * period_s;
  return change.head<2>().norm() > options_.max_step_m || std::abs(change.z()) > options_.max_step_rad;
}

void DriveOdometry::correct(const VehicleOdometry& odometry, FrameCounters* counters) {
  // Entries before a reset are not corrected: their bridged poses have been continued.
  const bool is_known = takes_corrections_ && raw_.add(odometry) == OdometryBuffer::AddResult::kCorrected;
  ++(is_known ? counters->odometry_corrections : counters->ignored_odometry);
  if (!is_known) {
    return;
  }
  VehicleOdometry bridged = odometry;
  bridged.odom_from_vehicle = bridged_from_odom_ * odometry.odom_from_vehicle;
  bridged_.add(bridged);
  if (odometry.stamp == last_->stamp) {
    last_ = odometry;
  }
}

std::optional<DriveBreak> DriveOdometry::add(const VehicleOdometry& odometry, FrameCounters* counters) {
  if (is_given_) {
    return std::nullopt;
  }
  if (last_ && odometry.stamp <= last_->stamp) {
    correct(odometry, counters);
    return std::nullopt;
  }
  std::optional<DriveBreak> found;
  if (last_) {
    const double period_s = toSeconds(odometry.stamp - last_->stamp);
    if (isReset(odometry)) {
      found = DriveBreak::kOdometryReset;
      ++counters->odometry_resets;
      const RigidTransform likely_motion = RigidTransform::planar(last_->forward_speed_m_per_s * period_s,
                                                                  0.0, last_->yaw_rate_rad_per_s * period_s);
      bridged_from_odom_ = bridged_from_odom_ * last_->odom_from_vehicle * likely_motion *
                           odometry.odom_from_vehicle.inverse();
      raw_before_reset_ = raw_;
      raw_ = OdometryBuffer(buffer_options_);
    } else if (period_s > options_.max_odometry_gap_s) {
      found = DriveBreak::kOdometryGap;
      ++counters->odometry_gaps;
    }
    velocity_ =
        found ? std::nullopt : std::make_optional<Eigen::Vector3d>(planarStep(*last_, odometry) / period_s);
  }
  last_ = odometry;
  raw_.add(odometry);
  VehicleOdometry bridged = odometry;
  bridged.odom_from_vehicle = bridged_from_odom_ * odometry.odom_from_vehicle;
  bridged_.add(bridged);
  return found;
}

OdometryBuffer::Lookup DriveOdometry::lookup(Timestamp stamp) const {
  const OdometryBuffer::Lookup found = raw_.lookup(stamp);
  return found.status == OdometryBuffer::LookupStatus::kBeforeFirst && !raw_before_reset_.empty()
             ? raw_before_reset_.lookup(stamp)
             : found;
}

}  // namespace vcharge
