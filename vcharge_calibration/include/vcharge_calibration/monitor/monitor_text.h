#pragma once

#include <string>
#include <vector>

#include "vcharge_calibration/intrinsics/intrinsic_calibration.h"
#include "vcharge_calibration/monitor/rig_monitor.h"

namespace vcharge {

/// The names of the deviations, in the order of RigDeviation: `odometer distance`, ..., `left yaw`, ...
std::vector<std::string> deviationNames(const CameraRig& rig);

/// A sentence, such as: camera left moved: pitch by 0.21 +- 0.02 degrees, between 51 and 72 m.
std::string describeChange(const CameraRig& rig, const RigChange& change);

/// What a monitored drive shows. PASS: nothing changed. WARN with what changed. FAIL: it shows nothing.
struct MonitorVerdict {
  Verdict grade = Verdict::kFail;
  std::vector<std::string> remarks;
};
/// `remarks`: those of the last repair.
MonitorVerdict judgeMonitoredDrive(const RigMonitor& monitor, const std::vector<std::string>& remarks);

}  // namespace vcharge
