#include "driver_report.h"

namespace vcharge {
namespace {

void add(const char* key, uint64_t value, DriveMonitor::Report* report) {
  report->values.emplace_back(key, std::to_string(value));
}

std::string milliseconds(double seconds) {
  return std::to_string(1e3 * seconds) + " ms";
}

}  // namespace

DriveMonitor::Report reportCamera(const std::string& name, const CameraStatus& status,
                                  const std::optional<TriggerCameraCounts>& counts) {
  DriveMonitor::Report report;
  const bool waits_for_alignment = status.streaming && counts && !counts->aligned;
  report.level = !status.streaming     ? DriveMonitor::Level::kError
                 : waits_for_alignment ? DriveMonitor::Level::kWarn
                                       : DriveMonitor::Level::kOk;
  report.message = name + ": " + status.message +
                   (waits_for_alignment ? ", not in step with its own numbers and stamps yet" : "");
  report.values.emplace_back("device", status.device);
  add("frames", status.frames, &report);
  add("lost", status.lost, &report);
  add("damaged", status.damaged, &report);
  add("timeouts", status.timeouts, &report);
  add("connections", status.connections, &report);
  if (status.exposure_s) {
    report.values.emplace_back("exposure", milliseconds(*status.exposure_s));
  }
  if (status.rate_hz) {
    report.values.emplace_back("frames per second", std::to_string(*status.rate_hz));
  }
  if (counts) {
    add("slips", counts->slips, &report);
    add("unaligned", counts->unaligned, &report);
    add("missing in groups", counts->missing, &report);
  }
  return report;
}

DriveMonitor::Report reportSync(const TriggerGrouperCounts& now, TriggerGrouperCounts* before) {
  DriveMonitor::Report report;
  const uint64_t complete = now.complete - before->complete;
  const uint64_t incomplete = now.incomplete - before->incomplete;
  uint64_t slips = 0;
  for (size_t i = 0; i < now.cameras.size(); ++i) {
    slips += now.cameras[i].slips - (before->cameras.empty() ? 0 : before->cameras[i].slips);
  }
  if (complete == 0) {
    report.level = DriveMonitor::Level::kError;
    report.message = "sync: no group of all cameras";
  } else if (incomplete > 0 || slips > 0) {
    report.level = DriveMonitor::Level::kWarn;
    report.message = "sync: " + std::to_string(incomplete) + " groups lack a camera, " +
                     std::to_string(slips) + " slips since the last report";
  } else {
    report.message = "sync: all cameras in every group";
  }
  add("complete groups", now.complete, &report);
  add("incomplete groups", now.incomplete, &report);
  add("late frames", now.late, &report);
  report.values.emplace_back("mean spread of stamps", milliseconds(now.mean_spread_s));
  report.values.emplace_back("largest spread of stamps", milliseconds(now.max_spread_s));
  *before = now;
  return report;
}

DriveMonitor::Report reportCan(const CanStatus& status) {
  DriveMonitor::Report report;
  const bool works = status.connected && !status.bus_off && !status.silent;
  report.level = works ? DriveMonitor::Level::kOk : DriveMonitor::Level::kError;
  report.message =
      "can: " + status.message + (status.connected && status.silent ? ", no wheel data comes" : "");
  add("measurements", status.measurements, &report);
  add("frames", status.decoded.frames, &report);
  add("too short", status.decoded.too_short, &report);
  add("counter wraps", status.decoded.wraps, &report);
  add("counter resets", status.decoded.resets, &report);
  add("invalid speeds", status.decoded.invalid, &report);
  add("error frames", status.error_frames, &report);
  add("bad frames", status.bad_frames, &report);
  add("connections", status.connections, &report);
  return report;
}

}  // namespace vcharge
