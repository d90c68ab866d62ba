#pragma once

#include <string>
#include <vector>

#include "vcharge_core/base/timestamp.h"
#include "vcharge_simulation/faults/exposure_faults.h"
#include "vcharge_simulation/faults/image_faults.h"

namespace vcharge {

/// Writes a YAML map whose list `faults` has one entry per active fault: its `kind`, all its options, the
/// stamps between which it acts (start_stamp_ns, end_stamp_ns; the latter is absent for a fault without end),
/// and per camera: the true stamps of randomly dropped or late images (images_ns), and the images of an
/// automatic exposure (exposures: lists of stamp_ns, exposure_time_s and gain). The file is replaced
/// atomically. Throws InputError if it cannot be written.
void writeFaults(const FaultOptions& faults, Timestamp start, const std::vector<std::string>& cameras,
                 const ImageFaults::Hits& hits,
                 const std::vector<std::vector<ExposureFaults::Record>>& exposures, const std::string& path);

}  // namespace vcharge
