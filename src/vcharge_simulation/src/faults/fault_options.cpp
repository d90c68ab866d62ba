#include "vcharge_simulation/faults/fault_options.h"

#include <algorithm>
#include <cmath>

namespace vcharge {
namespace {

void checkOnePerCamera(const CameraFault& fault, const char* name, const std::vector<double>& values) {
  requireField(values.size() == 1 || values.size() == fault.cameras.size(), name,
               "must have one number, or one per camera", static_cast<double>(values.size()));
}

/// A camera's value, where there is one for each of the fault's cameras or one for all.
double valueOf(const CameraFault& fault, const std::vector<double>& values, const std::string& camera,
               double otherwise) {
  for (size_t i = 0; i < fault.cameras.size(); ++i) {
    if (fault.cameras[i] == camera || fault.cameras[i] == "all") {
      return values[values.size() == 1 ? 0 : i];
    }
  }
  return otherwise;
}

}  // namespace

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
  checkOnePerCamera(*this, "gains", gains);
}

double CameraGainsFault::gainOf(const std::string& camera) const {
  return valueOf(*this, gains, camera, 1.0);
}

void ImageStampShiftFault::checkFields() const {
  CameraFault::checkFields();
  checkOnePerCamera(*this, "shifts_s", shifts_s);
  for (const double shift_s : shifts_s) {
    requireField(!moves_exposure || std::abs(shift_s) <= kMaxExposureShift_s, "shifts_s",
                 "must be within 0.1 s where moves_exposure is set", shift_s);
  }
}

double ImageStampShiftFault::shiftOf(const std::string& camera, Duration since_start) const {
  return actsAt(since_start) ? valueOf(*this, shifts_s, camera, 0.0) : 0.0;
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
