#include "vcharge_ros/conversions.h"

#include <cmath>
#include <limits>
#include <stdexcept>

#include "vcharge_core/base/error.h"

namespace vcharge {
namespace {

constexpr int64_t kNanosecondsPerSecond = 1000000000;
constexpr double kMaxNormError = 1e-3;

// Pose and Transform have the same fields with different names.
RigidTransform checkedTransform(const Eigen::Quaterniond& rotation, const Eigen::Vector3d& translation,
                                const std::string& source) {
  if (!translation.allFinite()) {
    throw InputError(source + ": expected a finite position, got (" + std::to_string(translation.x()) + ", " +
                     std::to_string(translation.y()) + ", " + std::to_string(translation.z()) + ")");
  }
  const double norm = rotation.norm();
  if (!(std::abs(norm - 1.0) <= kMaxNormError)) {
    throw InputError(source + ": expected an orientation quaternion of norm 1, got norm " +
                     std::to_string(norm));
  }
  return RigidTransform(rotation, translation);
}

void setRotation(const Eigen::Quaterniond& rotation, geometry_msgs::Quaternion* message) {
  message->x = rotation.x();
  message->y = rotation.y();
  message->z = rotation.z();
  message->w = rotation.w();
}

Eigen::Quaterniond toEigen(const geometry_msgs::Quaternion& message) {
  return Eigen::Quaterniond(message.w, message.x, message.y, message.z);
}

}  // namespace

Timestamp toTimestamp(const ros::Time& time) {
  return Timestamp::fromNanoseconds(static_cast<int64_t>(time.sec) * kNanosecondsPerSecond + time.nsec);
}

ros::Time fromTimestamp(Timestamp stamp) {
  const int64_t nanoseconds = stamp.nanoseconds();
  if (nanoseconds < 0 || nanoseconds / kNanosecondsPerSecond > std::numeric_limits<uint32_t>::max()) {
    throw std::out_of_range("stamp " + toString(stamp) + " is outside the range of ros::Time");
  }
  return ros::Time(static_cast<uint32_t>(nanoseconds / kNanosecondsPerSecond),
                   static_cast<uint32_t>(nanoseconds % kNanosecondsPerSecond));
}

geometry_msgs::Pose toPoseMessage(const RigidTransform& target_from_source) {
  geometry_msgs::Pose pose;
  pose.position.x = target_from_source.translation().x();
  pose.position.y = target_from_source.translation().y();
  pose.position.z = target_from_source.translation().z();
  setRotation(target_from_source.rotation(), &pose.orientation);
  return pose;
}

geometry_msgs::Transform toTransformMessage(const RigidTransform& target_from_source) {
  geometry_msgs::Transform transform;
  transform.translation.x = target_from_source.translation().x();
  transform.translation.y = target_from_source.translation().y();
  transform.translation.z = target_from_source.translation().z();
  setRotation(target_from_source.rotation(), &transform.rotation);
  return transform;
}

RigidTransform fromMessage(const geometry_msgs::Pose& pose, const std::string& source) {
  return checkedTransform(toEigen(pose.orientation),
                          Eigen::Vector3d(pose.position.x, pose.position.y, pose.position.z), source);
}

RigidTransform fromMessage(const geometry_msgs::Transform& transform, const std::string& source) {
  return checkedTransform(
      toEigen(transform.rotation),
      Eigen::Vector3d(transform.translation.x, transform.translation.y, transform.translation.z), source);
}

geometry_msgs::TransformStamped toTransformStamped(const RigidTransform& target_from_source, Timestamp stamp,
                                                   const std::string& target_frame,
                                                   const std::string& source_frame) {
  geometry_msgs::TransformStamped message;
  message.header.stamp = fromTimestamp(stamp);
  message.header.frame_id = target_frame;
  message.child_frame_id = source_frame;
  message.transform = toTransformMessage(target_from_source);
  return message;
}

std::vector<geometry_msgs::TransformStamped> cameraTransforms(const CameraRig& rig, Timestamp stamp) {
  std::vector<geometry_msgs::TransformStamped> transforms;
  for (const RigCamera& camera : rig.cameras) {
    if (camera.vehicle_from_camera) {
      transforms.push_back(
          toTransformStamped(*camera.vehicle_from_camera, stamp, rig.vehicle_frame, camera.frame_id));
    }
  }
  return transforms;
}

nav_msgs::Odometry toMessage(const VehicleOdometry& odometry, const std::string& odom_frame,
                             const std::string& vehicle_frame) {
  nav_msgs::Odometry message;
  message.header.stamp = fromTimestamp(odometry.stamp);
  message.header.frame_id = odom_frame;
  message.child_frame_id = vehicle_frame;
  message.pose.pose = toPoseMessage(odometry.odom_from_vehicle);
  message.twist.twist.linear.x = odometry.forward_speed_m_per_s;
  message.twist.twist.angular.z = odometry.yaw_rate_rad_per_s;
  return message;
}

VehicleOdometry fromMessage(const nav_msgs::Odometry& message, const std::string& source,
                            const std::string& vehicle_frame) {
  if (!message.child_frame_id.empty() && message.child_frame_id != vehicle_frame) {
    throw InputError(source + ": expected child_frame_id '" + vehicle_frame +
                     "' (the rig's vehicle_frame), got '" + message.child_frame_id + "'");
  }
  VehicleOdometry odometry;
  odometry.stamp = toTimestamp(message.header.stamp);
  odometry.odom_from_vehicle = fromMessage(message.pose.pose, source);
  odometry.forward_speed_m_per_s = message.twist.twist.linear.x;
  odometry.yaw_rate_rad_per_s = message.twist.twist.angular.z;
  if (!std::isfinite(odometry.forward_speed_m_per_s) || !std::isfinite(odometry.yaw_rate_rad_per_s)) {
    throw InputError(source + ": expected finite twist.linear.x and twist.angular.z");
  }
  return odometry;
}

vcharge_msgs::WheelTicks toMessage(const WheelTicks& ticks, const std::string& vehicle_frame) {
  vcharge_msgs::WheelTicks message;
  message.header.stamp = fromTimestamp(ticks.stamp);
  message.header.frame_id = vehicle_frame;
  message.left_ticks = ticks.left_ticks;
  message.right_ticks = ticks.right_ticks;
  message.metres_per_tick = ticks.metres_per_tick;
  message.steering_angle_rad = ticks.steering_angle_rad;
  return message;
}

WheelTicks fromMessage(const vcharge_msgs::WheelTicks& message, const std::string& source) {
  if (!(message.metres_per_tick > 0.0) || !std::isfinite(message.metres_per_tick)) {
    throw InputError(source + ": expected a positive metres_per_tick, got " +
                     std::to_string(message.metres_per_tick));
  }
  if (!std::isfinite(message.steering_angle_rad)) {
    throw InputError(source + ": expected a finite steering_angle_rad");
  }
  WheelTicks ticks;
  ticks.stamp = toTimestamp(message.header.stamp);
  ticks.left_ticks = message.left_ticks;
  ticks.right_ticks = message.right_ticks;
  ticks.metres_per_tick = message.metres_per_tick;
  ticks.steering_angle_rad = message.steering_angle_rad;
  return ticks;
}

}  // namespace vcharge
