#pragma once

#include <memory>
#include <optional>
#include <string>

#include "vcharge_core/camera/camera_rig.h"
#include "vcharge_mapping/sparse_mapper_options.h"
#include "vcharge_reconstruction/mapping_state.h"

namespace vcharge {

/// What a checkpoint is good for: the same drive, rig (with its masks), options and program. `drive_hash` and
/// `program` are any texts that tell drives and versions of the code apart.
std::string checkpointKey(const std::string& drive_hash, const CameraRig& rig,
                          const SparseMapperOptions& options, const std::string& program);

/// Keeps the state after a stage in a file, which is replaced once the new one is complete. InputError naming
/// the file and why it cannot be written (disk full, no such folder, ...).
void writeCheckpoint(const MappingState& state, const std::string& key, const std::string& path);

struct CheckpointReading {
  std::optional<MappingState> state;
  /// Why there is no state; empty where there is no file either.
  std::string refusal;
};

/// Reads what writeCheckpoint() wrote, exact to the last bit. A file that is truncated, damaged, foreign, of
/// another format or made with another key is refused, saying which. `rig` becomes that of the state.
CheckpointReading readCheckpoint(const std::string& path, const std::string& key,
                                 std::shared_ptr<const CameraRig> rig);

}  // namespace vcharge
