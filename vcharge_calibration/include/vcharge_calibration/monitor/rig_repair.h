#pragma once

#include <memory>
#include <string>
#include <vector>

#include "vcharge_calibration/monitor/rig_monitor.h"
#include "vcharge_core/camera/camera_rig.h"

namespace vcharge {

/// A rig in which the cameras that moved are where they are now.
struct RigRepair {
  /// Null: nothing to repair, or not yet. Its provenance is its version and the evidence.
  std::shared_ptr<const CameraRig> rig;
  std::vector<std::string> cameras;  ///< that moved and were repaired
  std::vector<std::string> remarks;  ///< why a camera that moved was not repaired
};

/// Repairs the cameras that moved, with their covariances; the others keep theirs. A camera is repaired once
/// it has been still for some parts of the drive, and is certain enough.
RigRepair repairRig(const RigMonitor& monitor);

}  // namespace vcharge
