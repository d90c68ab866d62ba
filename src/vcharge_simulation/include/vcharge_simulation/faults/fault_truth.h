#pragma once

#include <string>
#include <vector>

#include "vcharge_core/base/timestamp.h"
#include "vcharge_simulation/faults/image_faults.h"

namespace vcharge {

/// Writes a YAML map whose list `faults` has one entry per active fault: its `kind`, all its options, the
/// stamps between which it acts (start_stamp_ns, end_stamp_ns; the latter is absent for a fault without end),
/// and, for randomly dropped or late images, their true stamps per camera (images_ns). The file is replaced
/// atomically. Throws InputError if it cannot be written.
void writeFaults(const FaultOptions& faults, Timestamp start, const std::vector<std::string>& cameras,
                 const ImageFaults::Hits& hits, const std::string& path);

}  // namespace vcharge
