#pragma once

#include <string>

#include "vcharge_simulation/drive/drive_scenario.h"

namespace vcharge {

/// Outputs of simulate_drive.
struct RecordingOptions {
  std::string bag;  ///< bag to write; rig_truth.yaml and the folder BAG_truth are written beside it
  /// Noise-free bag of the same drive, whose images are used; those that faults change are rendered.
  std::string images_from;
  bool truth_range = false;
  double height_cell_m = 0.1;
};

/// Simulates the scenario's drive and writes the bag, the rig and the truth, or nothing on failure. Shows a
/// progress bar. Throws InputError for files that cannot be read or written, an unknown scene, drive or
/// camera, and images of another drive.
void recordDrive(const DriveScenario& scenario, const RecordingOptions& recording);

}  // namespace vcharge
