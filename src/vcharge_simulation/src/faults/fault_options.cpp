#include "vcharge_simulation/faults/fault_options.h"

#include <algorithm>

namespace vcharge {

bool FaultInterval::actsAt(Duration since_start) const {
  return (start_s == 0.0 || since_start >= durationFromSeconds(start_s)) &&
         (end_s == 0.0 || since_start < durationFromSeconds(end_s));
}

void FaultInterval::checkFields() const {
  requireField(end_s == 0.0 || end_s > start_s, "end_s", "must be 0 or after start_s", end_s);
}

bool CameraFault::actsOn(const std::string& camera) const {
  return std::any_of(cameras.begin(), cameras.end(),
                     [&](const std::string& name) { return name == camera || name == "all"; });
}

void BumpedCameraFault::checkFields() const {
  CameraFault::checkFields();
  for (const auto& [name, vector] :
       {std::pair("rotation_rad", &rotation_rad), std::pair("translation_m", &translation_m)}) {
    requireField(vector->size() == 3, name, "must have three numbers", static_cast<double>(vector->size()));
  }
}

void SwappedCamerasFault::validate() const {
  CameraFault::validate();
  requireField(cameras.empty() || (cameras.size() == 2 && cameras[0] != cameras[1]), "cameras",
               "must be two different cameras", static_cast<double>(cameras.size()));
}

}  // namespace vcharge
