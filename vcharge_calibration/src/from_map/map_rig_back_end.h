#pragma once

#include <vector>

#include "vcharge_calibration/from_map/map_rig_calibrator.h"

namespace vcharge {

/// Calibrates by a drive whose cameras were found in a map, each alone; `state` has the rig, the poses and
/// the landmarks that were seen in the end; `landmark_of_track` says which of the map's they are.
RigCalibration runMapRigBackEnd(const MapRigCalibratorOptions& options, const SparseMap& map,
                                const MapLocalizer& localizer, const std::vector<MapKeyframeView>& views,
                                const StageCallback& progress, MappingState* state,
                                std::vector<int32_t>* landmark_of_track);

}  // namespace vcharge
