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

void BrightLampsFault::checkFields() const {
  CameraFault::checkFields();
  requireField(positions_m.size() % 3 == 0, "positions_m", "must have three numbers per lamp",
               static_cast<double>(positions_m.size()));
  requireField(image_positions.size() % 2 == 0, "image_positions", "must have two numbers per lamp",
               static_cast<double>(image_positions.size()));
}

void CameraGainsFault::checkFields() const {
  CameraFault::checkFields();
  requireField(gains.size() == 1 || gains.size() == cameras.size(), "gains",
               "must have one number, or one per camera", static_cast<double>(gains.size()));
}

double CameraGainsFault::gainOf(const std::string& camera) const {
  for (size_t i = 0; i < cameras.size(); ++i) {
    if (cameras[i] == camera || cameras[i] == "all") {
      return gains[gains.size() == 1 ? 0 : i];
    }
  }
  return 1.0;
}

Duration OdometryStampShiftFault::shiftAt(Duration since_start) const {
  if (!actsAt(since_start)) {
    return Duration(0);
  }
  return durationFromSeconds(shift_s + 1e-6 * drift_ppm * (toSeconds(since_start) - start_s));
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
