#include "vcharge_core/frames/standstill.h"

namespace vcharge {
namespace {

// The second period is for the first moments after the odometry has begun.
constexpr double kPeriods_s[] = {0.1, 0.04};
constexpr double kStanding_m_per_s = 0.02;
constexpr double kStanding_rad_per_s = 0.01;

}  // namespace

bool standsAt(const DriveOdometry& odometry, Timestamp stamp) {
  const OdometryBuffer::Lookup now = odometry.lookup(stamp);
  for (const double period_s : kPeriods_s) {
    const OdometryBuffer::Lookup before = odometry.lookup(stamp - durationFromSeconds(period_s));
    if (now && before) {
      const RigidTransform motion =
          before.odometry.odom_from_vehicle.inverse() * now.odometry.odom_from_vehicle;
      return motion.translation().norm() < period_s * kStanding_m_per_s &&
             angleOfRotation(motion.rotation()) < period_s * kStanding_rad_per_s;
    }
  }
  return true;
}

}  // namespace vcharge
