#pragma once

#include <string>

#include "vcharge_simulation/drive/drive_scenario.h"

namespace vcharge {

/// Where and what simulate_drive writes.
struct RecordingOptions {
  std::string bag;          ///< rig_truth.yaml and BAG_truth/ go beside it
  std::string images_from;  ///< a noise-free bag of the same drive: its images are used, nothing is rendered
  bool truth_range = false;
  double height_cell_m = 0.1;
  double height_limit_m = 2.5;
  void validate() const;  ///< throws std::invalid_argument naming the field
};

/// Simulates the scenario's drive and writes its bag, its rig and its truth: all of them or none. Shows its
/// progress. InputError for what cannot be read or written, for an unknown scene, drive or camera, and for
/// images that are not those of this drive.
void recordDrive(const DriveScenario& scenario, const RecordingOptions& recording);

}  // namespace vcharge
