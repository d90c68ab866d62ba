#pragma once

#include <mutex>
#include <optional>
#include <string>

#include <ros/node_handle.h>
#include <tf2_ros/transform_broadcaster.h>

#include "vcharge_ros/drive_monitor.h"
#include "vcharge_wheel_odometry/wheel_odometry.h"

namespace vcharge {

/// Computes odometry from wheel data and publishes it as /odom and odom -> base_link, in stamp order and
/// with an estimate at each trigger. Thread safe.
class OdometryPublisher {
 public:
  OdometryPublisher(ros::NodeHandle* node, const WheelOdometryOptions& options, double frame_rate_hz,
                    const std::string& topic, std::string vehicle_frame);

  void add(const WheelMeasurement& wheels);
  void trigger(Timestamp stamp);
  DriveMonitor::Report report();

 private:
  void publish(const std::vector<OdometryEstimate>& estimates);

  const std::string vehicle_frame_;
  ros::Publisher publisher_;
  tf2_ros::TransformBroadcaster broadcaster_;
  std::mutex mutex_;
  WheelOdometry odometry_;
  OdometryStream stream_;
  std::optional<Timestamp> broadcast_;
  uint64_t reported_measurements_ = 0;
  uint64_t reported_slips_ = 0;
};

}  // namespace vcharge
