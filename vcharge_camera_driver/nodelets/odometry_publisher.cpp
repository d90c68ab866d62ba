#include "odometry_publisher.h"

#include <nav_msgs/Odometry.h>

#include "vcharge_ros/conversions.h"

namespace vcharge {
namespace {

constexpr double kUnknownVariance = 1e6;  // variance of height, roll and pitch, which wheels do not measure

nav_msgs::Odometry toMessage(const OdometryEstimate& estimate, const std::string& vehicle_frame) {
  nav_msgs::Odometry message = vcharge::toMessage(estimate.odometry, "odom", vehicle_frame);
  const int planar[] = {0, 1, 5};  // indices of x, y and yaw in x, y, z, roll, pitch, yaw
  for (const int i : {2, 3, 4}) {
    message.pose.covariance[7 * i] = kUnknownVariance;
    message.twist.covariance[7 * i] = kUnknownVariance;
  }
  for (int row = 0; row < 3; ++row) {
    for (int column = 0; column < 3; ++column) {
      message.pose.covariance[6 * planar[row] + planar[column]] = estimate.pose_covariance(row, column);
    }
  }
  message.twist.covariance[0] = estimate.speed_variance;
  message.twist.covariance[7] = 1e-4;  // no side slip at parking speeds
  message.twist.covariance[35] = estimate.yaw_rate_variance;
  return message;
}

}  // namespace

OdometryPublisher::OdometryPublisher(ros::NodeHandle* node, const WheelOdometryOptions& options,
                                     double frame_rate_hz, const std::string& topic,
                                     std::string vehicle_frame)
    : vehicle_frame_(std::move(vehicle_frame)),
      publisher_(node->advertise<nav_msgs::Odometry>(topic, 100)),
      odometry_(options),
      stream_(OdometryStream::forFrameRate(frame_rate_hz)) {}

void OdometryPublisher::publish(const std::vector<OdometryEstimate>& estimates) {
  for (const OdometryEstimate& estimate : estimates) {
    // tf keeps the first transform of a stamp: a correction goes to the topic only.
    if (broadcast_ != estimate.odometry.stamp) {
      broadcaster_.sendTransform(toTransformStamped(estimate.odometry.odom_from_vehicle,
                                                    estimate.odometry.stamp, "odom", vehicle_frame_));
      broadcast_ = estimate.odometry.stamp;
    }
    publisher_.publish(toMessage(estimate, vehicle_frame_));
  }
}

void OdometryPublisher::add(const WheelMeasurement& wheels) {
  const std::lock_guard<std::mutex> lock(mutex_);
  if (const std::optional<OdometryEstimate> estimate = odometry_.add(wheels)) {
    publish(stream_.add(*estimate));
  }
}

void OdometryPublisher::trigger(Timestamp stamp) {
  const std::lock_guard<std::mutex> lock(mutex_);
  publish(stream_.trigger(stamp));
}

DriveMonitor::Report OdometryPublisher::report() {
  const std::lock_guard<std::mutex> lock(mutex_);
  const WheelOdometryCounts& counts = odometry_.counts();
  DriveMonitor::Report report;
  const bool silent = counts.measurements == reported_measurements_;
  const bool slipped = counts.slipping || counts.slips > reported_slips_;
  report.level = silent    ? DriveMonitor::Level::kError
                 : slipped ? DriveMonitor::Level::kWarn
                           : DriveMonitor::Level::kOk;
  report.message = silent            ? "no wheel data"
                   : slipped         ? "a wheel slips"
                   : counts.standing ? "the vehicle stands"
                                     : "the vehicle moves";
  reported_measurements_ = counts.measurements;
  reported_slips_ = counts.slips;
  report.values = {{"measurements", std::to_string(counts.measurements)},
                   {"slips", std::to_string(counts.slips)},
                   {"gaps", std::to_string(counts.gaps)},
                   {"counter resets", std::to_string(counts.resets)},
                   {"out of order", std::to_string(counts.out_of_order)}};
  return report;
}

}  // namespace vcharge
