#include "vcharge_simulation/faults/fault_options.h"

#include <algorithm>
#include <cmath>
#include <stdexcept>

namespace vcharge {

namespace {

constexpr double kMaxShift_s = 10.0;

void requireVector(const std::vector<double>& vector, const char* field) {
  requireField(vector.size() == 3, field, "must have three numbers", static_cast<double>(vector.size()));
  for (const double value : vector) {
    requireField(std::isfinite(value), field, "must be finite", value);
  }
}

// Names an error's fault, and asks every fault.
struct Validator {
  template <class Fault>
  void operator()(const char* name, const Fault& fault) {
    validateInner(name, fault);
  }
};

}  // namespace

bool FaultInterval::actsAt(Duration since_start) const {
  return (start_s == 0.0 || since_start >= durationFromSeconds(start_s)) &&
         (end_s == 0.0 || since_start < durationFromSeconds(end_s));
}

void FaultInterval::validate() const {
  requireField(std::isfinite(start_s) && start_s >= 0.0, "start_s", "must not be negative", start_s);
  requireField(std::isfinite(end_s) && (end_s == 0.0 || end_s > start_s), "end_s",
               "must be 0 or after start_s", end_s);
}

bool CameraFault::actsOn(const std::string& camera) const {
  return std::any_of(cameras.begin(), cameras.end(),
                     [&](const std::string& name) { return name == camera || name == "all"; });
}

void SunGlareFault::validate() const {
  CameraFault::validate();
  requireField(std::isfinite(x), "x", "must be finite", x);
  requireField(std::isfinite(y), "y", "must be finite", y);
  requireField(std::isfinite(light) && light > 0.0, "light", "must be positive", light);
  requireField(std::isfinite(radius_px) && radius_px > 0.0, "radius_px", "must be positive", radius_px);
}

void DirtyLensFault::validate() const {
  CameraFault::validate();
  requireField(blobs >= 0 && blobs <= 1000, "blobs", "must be in [0, 1000]", blobs);
  requireField(std::isfinite(blob_radius_px) && blob_radius_px > 0.0, "blob_radius_px", "must be positive",
               blob_radius_px);
  requireField(blob_transmission >= 0.0 && blob_transmission <= 1.0, "blob_transmission", "must be in [0, 1]",
               blob_transmission);
  requireField(std::isfinite(line_light) && line_light >= 0.0, "line_light", "must not be negative",
               line_light);
  requireField(std::isfinite(line_half_width_px) && line_half_width_px > 0.0, "line_half_width_px",
               "must be positive", line_half_width_px);
  requireField(seed >= 0, "seed", "must not be negative", seed);
}

void BumpedCameraFault::validate() const {
  CameraFault::validate();
  requireVector(rotation_rad, "rotation_rad");
  requireVector(translation_m, "translation_m");
}

void SwappedCamerasFault::validate() const {
  CameraFault::validate();
  requireField(cameras.empty() || (cameras.size() == 2 && cameras[0] != cameras[1]), "cameras",
               "must be two different cameras", static_cast<double>(cameras.size()));
}

void DroppedImagesFault::validate() const {
  CameraFault::validate();
  requireField(probability >= 0.0 && probability <= 1.0, "probability", "must be in [0, 1]", probability);
}

void LateImagesFault::validate() const {
  DroppedImagesFault::validate();
  requireField(delay_s > 0.0 && delay_s <= kMaxShift_s, "delay_s", "must be in (0, 10]", delay_s);
}

void ImageStampShiftFault::validate() const {
  CameraFault::validate();
  requireField(std::abs(shift_s) <= kMaxShift_s, "shift_s", "must be in [-10, 10]", shift_s);
}

void ExposureStepFault::validate() const {
  CameraFault::validate();
  requireField(gain >= 0.01 && gain <= 100.0, "gain", "must be in [0.01, 100]", gain);
}

void MotionBlurFault::validate() const {
  CameraFault::validate();
  requireField(exposure_time_s > 0.0 && exposure_time_s <= 0.08, "exposure_time_s", "must be in (0, 0.08]",
               exposure_time_s);
  requireField(renderings >= 2 && renderings <= 64, "renderings", "must be in [2, 64]", renderings);
}

void OdometryStampShiftFault::validate() const {
  FaultInterval::validate();
  requireField(std::abs(shift_s) <= kMaxShift_s, "shift_s", "must be in [-10, 10]", shift_s);
}

void OdometryScaleFault::validate() const {
  FaultInterval::validate();
  requireField(factor > 0.0 && factor <= 10.0, "factor", "must be in (0, 10]", factor);
}

void WheelSlipFault::validate() const {
  FaultInterval::validate();
  requireField(ratio >= -1.0 && ratio <= 10.0, "ratio", "must be in [-1, 10]", ratio);
}

void CounterResetFault::validate() const {
  requireField(std::isfinite(time_s) && time_s >= 0.0, "time_s", "must not be negative", time_s);
}

void SoftSuspensionFault::validate() const {
  requireField(pitch_factor >= 0.0 && pitch_factor <= 50.0, "pitch_factor", "must be in [0, 50]",
               pitch_factor);
}

void FaultOptions::validate() const {
  FaultOptions copy = *this;
  copy.visitFields(Validator());
}

std::vector<CatalogueEntry> listFaults() {
  return {{"dead_camera", "cameras deliver no images, or black ones"},
          {"frozen_camera", "cameras deliver their last image again and again"},
          {"sun_glare", "a low sun shines into the lens: a white disk and veiling glare"},
          {"dirty_lens", "a fixed bright line and blobs in the image"},
          {"bumped_camera", "cameras are turned by rotation_rad and moved by translation_m"},
          {"swapped_cameras", "two cameras deliver their images under each other's name"},
          {"dropped_images", "images get lost, with a probability"},
          {"late_images", "images arrive delay_s late, with a probability"},
          {"image_stamp_shift", "stamps of cameras are off by shift_s"},
          {"exposure_step", "the exposure steps to gain times what it was"},
          {"motion_blur", "long exposures of exposure_time_s"},
          {"odometry_stamp_shift", "stamps of odometry and wheel counters are off by shift_s"},
          {"odometry_scale", "both wheels count factor times what they should"},
          {"wheel_slip", "the wheel spins (ratio > 0) or blocks (ratio -1)"},
          {"missing_ticks", "neither wheel counters nor odometry come from start_s to end_s"},
          {"counter_reset", "wheel counters and dead reckoning start again from zero at time_s"},
          {"soft_suspension", "the body pitches by pitch_factor times its angle on brakes and throttle"}};
}

}  // namespace vcharge
