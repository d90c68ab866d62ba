#include "localization_report.h"

#include <string>

#include "vcharge_reconstruction/localization_status.h"

namespace vcharge {

void LocalizationReport::add(const vcharge_msgs::LocalizationStatus& status) {
  const std::lock_guard<std::mutex> lock(mutex_);
  last_ = status;
  ++num_frames_;
}

DriveMonitor::Report LocalizationReport::report(uint64_t num_dropped, const FrameCounters& counters) {
  const std::lock_guard<std::mutex> lock(mutex_);
  DriveMonitor::Report report;
  report.level = DriveMonitor::Level::kWarn;
  report.message = "no frame yet";
  if (num_frames_ > 0) {
    if (last_.status == vcharge_msgs::LocalizationStatus::LOCALIZED && last_.camera_warnings.empty()) {
      report.level = DriveMonitor::Level::kOk;
    }
    report.message = enumNames<LocalizationStatus>()[last_.status];
    if (!last_.message.empty()) {
      report.message += ": " + last_.message;
    }
    for (const std::string& warning : last_.camera_warnings) {
      report.message += "; " + warning;
    }
  }
  report.values.emplace_back("frames", std::to_string(num_frames_));
  report.values.emplace_back("dropped", std::to_string(num_dropped));
  report.values.emplace_back("inliers", std::to_string(last_.num_inliers));
  report.values.emplace_back("position_sigma_m", std::to_string(last_.position_sigma_m));
  addCounters(counters, &report);
  return report;
}

}  // namespace vcharge
