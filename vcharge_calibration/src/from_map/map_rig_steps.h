#pragma once

#include <cstdint>
#include <vector>

#include "vcharge_calibration/from_map/map_rig_calibrator.h"

namespace vcharge {

/// The steps of MapRigCalibrator::finish(): calibrates from keyframes whose cameras were localized
/// separately. The localizer is of the
/// same map. Afterwards, `state` has the rig, poses and observed landmarks, `landmark_of_track` their
/// indices in the map.
RigCalibration calibrateInMap(const MapRigCalibratorOptions& options, const SparseMap& map,
                              const MapLocalizer& localizer, const std::vector<MapKeyframeView>& views,
                              const StageCallback& progress, ReconstructionState* state,
                              std::vector<int32_t>* landmark_of_track);

}  // namespace vcharge
