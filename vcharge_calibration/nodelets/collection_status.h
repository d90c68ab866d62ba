#pragma once

#include <limits>
#include <mutex>
#include <string>

#include <ros/node_handle.h>
#include <vcharge_msgs/CalibrationStatus.h>

#include "vcharge_calibration/intrinsics/view_collector.h"
#include "vcharge_ros/drive_monitor.h"

namespace vcharge {

/// State of the collection of views and of the calibration, on /calibration/status (latched) and for
/// /diagnostics. Thread safe.
class CollectionStatus {
 public:
  using Message = vcharge_msgs::CalibrationStatus;

  CollectionStatus(ros::NodeHandle* node, const std::string& subject)
      : publisher_(node->advertise<Message>("/calibration/status", 10, true)) {
    message_.subject = subject;
    message_.rms_px = std::numeric_limits<double>::quiet_NaN();
  }

  void publish(uint8_t state, const std::string& text, double progress, const ViewCollector& collector) {
    const std::lock_guard<std::mutex> lock(mutex_);
    message_.header.stamp = ros::Time::now();
    message_.state = state;
    message_.message = text;
    message_.progress = progress;
    message_.missing = collector.missing();
    message_.num_views = static_cast<uint32_t>(collector.images().size());
    message_.covered_fraction = collector.coveredFraction();
    publisher_.publish(message_);
  }

  /// NaN: there is no result.
  void setRms(double rms_px) {
    const std::lock_guard<std::mutex> lock(mutex_);
    message_.rms_px = rms_px;
  }

  DriveMonitor::Report report() {
    const std::lock_guard<std::mutex> lock(mutex_);
    DriveMonitor::Report report;
    report.level = message_.state == Message::FAILED ? DriveMonitor::Level::kError
                   : message_.missing.empty()        ? DriveMonitor::Level::kOk
                                                     : DriveMonitor::Level::kWarn;
    report.message = message_.missing.empty() ? message_.message : "missing: " + message_.missing.front();
    report.values = {{"views", std::to_string(message_.num_views)},
                     {"covered_fraction", std::to_string(message_.covered_fraction)},
                     {"last image", message_.message}};
    return report;
  }

 private:
  std::mutex mutex_;
  Message message_;
  ros::Publisher publisher_;
};

}  // namespace vcharge
