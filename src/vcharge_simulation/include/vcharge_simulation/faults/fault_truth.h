#pragma once

#include <string>
#include <vector>

#include "vcharge_core/base/timestamp.h"
#include "vcharge_simulation/faults/image_faults.h"

namespace vcharge {

/// Writes a YAML map whose list `faults` has an entry per active fault: its `kind`, all its options, the
/// stamps at which it starts and ends (start_stamp_ns, end_stamp_ns; no end: end_stamp_ns is absent), and for
/// random faults of images the true stamps of those they hit (images_ns: camera: stamps). Replaces the file
/// only once it is complete; InputError when it cannot be written.
void writeFaults(const FaultOptions& faults, Timestamp start, const std::vector<std::string>& cameras,
                 const ImageFaults::Hits& hits, const std::string& path);

}  // namespace vcharge
