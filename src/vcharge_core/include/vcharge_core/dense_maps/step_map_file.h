#pragma once

#include <string>
#include <vector>

#include "vcharge_core/dense_maps/step_map.h"

namespace vcharge {

/// One stamp's step map on disk, in FOLDER: <stamp_ns>_steps_{ground,height,sigma}.tiff (CV_32FC1, rows as in
/// StepMap) and <stamp_ns>_steps.yaml, written last: where it exists the stamp is complete.
void writeStepMap(const StepMap& map, const std::string& folder);

/// Stamps in a folder, ascending. InputError when there is no such folder.
std::vector<Timestamp> listStepMaps(const std::string& folder);

/// Throws InputError naming the file that is missing, malformed or has a different size.
StepMap readStepMap(const std::string& folder, Timestamp stamp);

}  // namespace vcharge
