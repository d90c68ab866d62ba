#pragma once

#include <functional>
#include <memory>
#include <string>
#include <vector>

#include "vcharge_core/sparse_map/sparse_map.h"
#include "vcharge_mapping/sparse_mapper_options.h"
#include "vcharge_reconstruction/mapping_state.h"
#include "vcharge_reconstruction/stage_progress.h"

namespace vcharge {

/// Called with the name of a stage that is done and what is known then.
using CheckpointCallback = std::function<void(const std::string& stage, const MappingState&)>;

/// Names of the stages that make a map of a drive that was followed, in order.
const std::vector<std::string>& backEndStages();

/// Runs the stages that `state` has not been through. What either callback throws ends the work and is passed
/// on; the state is then that after some stage or inside one, and of no more use. InputError where the drive
/// does not suffice, saying why.
std::shared_ptr<const SparseMap> runBackEnd(const SparseMapperOptions& options, const StageCallback& progress,
                                            const CheckpointCallback& checkpoint, MappingState* state);

}  // namespace vcharge
