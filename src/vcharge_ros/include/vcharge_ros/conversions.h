#pragma once

#include <string>
#include <vector>

#include <geometry_msgs/Pose.h>
#include <geometry_msgs/Transform.h>
#include <geometry_msgs/TransformStamped.h>
#include <nav_msgs/Odometry.h>
#include <ros/time.h>
#include <vcharge_msgs/WheelTicks.h>

#include "vcharge_core/base/timestamp.h"
#include "vcharge_core/camera/camera_rig.h"
#include "vcharge_core/motion/rigid_transform.h"
#include "vcharge_core/motion/vehicle_odometry.h"

namespace vcharge {

/// Converts a ROS time to a Timestamp without rounding.
Timestamp toTimestamp(const ros::Time& time);
/// Converts to a ROS time. Throws std::out_of_range for stamps before 0 or after 2^32 s.
ros::Time fromTimestamp(Timestamp stamp);

geometry_msgs::Pose toPoseMessage(const RigidTransform& target_from_source);
geometry_msgs::Transform toTransformMessage(const RigidTransform& target_from_source);
/// Throws InputError "<source>: ..." if a number is not finite or the quaternion's norm is off by over 1e-3.
RigidTransform fromMessage(const geometry_msgs::Pose& pose, const std::string& source);
RigidTransform fromMessage(const geometry_msgs::Transform& transform, const std::string& source);
/// The parent frame in TF is `target_frame`, the child frame is `source_frame`.
geometry_msgs::TransformStamped toTransformStamped(const RigidTransform& target_from_source, Timestamp stamp,
                                                   const std::string& target_frame,
                                                   const std::string& source_frame);
/// Transforms from the vehicle frame to each camera whose extrinsics are known.
std::vector<geometry_msgs::TransformStamped> cameraTransforms(const CameraRig& rig, Timestamp stamp);

/// The speed becomes twist.linear.x and the yaw rate twist.angular.z, both in the child frame.
nav_msgs::Odometry toMessage(const VehicleOdometry& odometry, const std::string& odom_frame,
                             const std::string& vehicle_frame);
/// Throws InputError "<source>: ..." for an invalid pose (see above), velocities that are not finite, or a
/// child_frame_id other than `vehicle_frame`; an empty one is accepted.
VehicleOdometry fromMessage(const nav_msgs::Odometry& message, const std::string& source,
                            const std::string& vehicle_frame);

vcharge_msgs::WheelTicks toMessage(const WheelTicks& ticks, const std::string& vehicle_frame);
/// Throws InputError "<source>: ..." if metres_per_tick is not positive or a number is not finite.
WheelTicks fromMessage(const vcharge_msgs::WheelTicks& message, const std::string& source);

}  // namespace vcharge
