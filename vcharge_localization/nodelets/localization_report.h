#pragma once

#include <cstdint>
#include <mutex>

#include <vcharge_msgs/LocalizationStatus.h>

#include "vcharge_ros/drive_monitor.h"
#include "vcharge_ros/nodelet_support.h"

namespace vcharge {

/// What /diagnostics tells of the pose: good while it is localized and no camera is blamed. Thread safe.
class LocalizationReport {
 public:
  void add(const vcharge_msgs::LocalizationStatus& status);

  /// Of the frames so far; an error of the callbacks is reported once.
  DriveMonitor::Report report(const CallbackGuard& guard, uint64_t num_dropped);

 private:
  std::mutex mutex_;
  vcharge_msgs::LocalizationStatus last_;
  uint64_t num_frames_ = 0, reported_failures_ = 0;
};

}  // namespace vcharge
