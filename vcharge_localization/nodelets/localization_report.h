#pragma once

#include <cstdint>
#include <mutex>

#include <vcharge_msgs/LocalizationStatus.h>

#include "vcharge_ros/drive_monitor.h"
#include "vcharge_ros/nodelet_support.h"

namespace vcharge {

/// The status of the pose on /diagnostics: OK while localized and no camera has a warning. Thread
/// safe.
class LocalizationReport {
 public:
  void add(const vcharge_msgs::LocalizationStatus& status);
  DriveMonitor::Report report(uint64_t num_dropped, const FrameCounters& counters);

 private:
  std::mutex mutex_;
  vcharge_msgs::LocalizationStatus last_;
  uint64_t num_frames_ = 0;
};

}  // namespace vcharge
