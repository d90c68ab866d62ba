#pragma once

#include <string>
#include <vector>

#include "vcharge_core/base/options.h"
#include "vcharge_core/base/timestamp.h"
#include "vcharge_simulation/scenes/scene_catalogue.h"

namespace vcharge {

/// When a fault acts, in seconds since the start of the drive: from start_s on and before end_s.
struct FaultInterval {
  double start_s = 0.0;  ///< 0: it has always been there
  double end_s = 0.0;    ///< 0: it never ends

  bool actsAt(Duration since_start) const;
  template <class Visitor>
  void visitFields(Visitor&& visit) {
    visit("start_s", start_s);
    visit("end_s", end_s);
  }
  void validate() const;  ///< throws std::invalid_argument naming the field
};

/// A fault of cameras, by name or "all"; no camera: no fault. It stays with the camera where plugs are
/// swapped.
struct CameraFault : FaultInterval {
  std::vector<std::string> cameras;

  bool isActive() const { return !cameras.empty(); }
  bool actsOn(const std::string& camera) const;
  bool actsOn(const std::string& camera, Duration since_start) const {
    return actsOn(camera) && actsAt(since_start);
  }
  template <class Visitor>
  void visitFields(Visitor&& visit) {
    visit("cameras", cameras);
    FaultInterval::visitFields(visit);
  }
};

/// Images come no more, or black ones.
struct DeadCameraFault : CameraFault {
  bool black_images = false;

  template <class Visitor>
  void visitFields(Visitor&& visit) {
    CameraFault::visitFields(visit);
    visit("black_images", black_images);
  }
};

/// The last image before the fault comes again and again, with new stamps.
struct FrozenCameraFault : CameraFault {};

/// A low sun shines into the lens: a white disk, and veiling glare that falls with the squared distance from
/// it.
struct SunGlareFault : CameraFault {
  double x = 0.5;  ///< place of the sun as a share of the image's width and height, from its corner
  double y = 0.4;
  double light = 25.0;      ///< in the middle of the sun, where 1 is white in the sun
  double radius_px = 40.0;  ///< at which light has fallen to half; in an image that is 1280 wide

  template <class Visitor>
  void visitFields(Visitor&& visit) {
    CameraFault::visitFields(visit);
    visit("x", x);
    visit("y", y);
    visit("light", light);
    visit("radius_px", radius_px);
  }
  void validate() const;
};

/// Dirt that stays in its place in the image: a bright line across it, and blurred blobs that keep light away
/// and scatter light of their own.
struct DirtyLensFault : CameraFault {
  int blobs = 8;
  double blob_radius_px = 45.0;     ///< of the largest one; in an image that is 1280 wide
  double blob_transmission = 0.35;  ///< share of the light that passes the middle of a blob
  double line_light = 0.5;          ///< where 1 is white in the sun
  double line_half_width_px = 2.5;  ///< in an image that is 1280 wide
  int seed = 1;                     ///< of the places; each camera has dirt of its own

  template <class Visitor>
  void visitFields(Visitor&& visit) {
    CameraFault::visitFields(visit);
    visit("blobs", blobs);
    visit("blob_radius_px", blob_radius_px);
    visit("blob_transmission", blob_transmission);
    visit("line_light", line_light);
    visit("line_half_width_px", line_half_width_px);
    visit("seed", seed);
  }
  void validate() const;
};

/// The camera is knocked: vehicle_from_camera becomes vehicle_from_camera * (rotation, translation).
struct BumpedCameraFault : CameraFault {
  std::vector<double> rotation_rad = {0.0, 0.05, 0.0};  ///< rotation vector in the camera's frame
  std::vector<double> translation_m = {0.0, 0.0, 0.0};  ///< in the camera's frame

  template <class Visitor>
  void visitFields(Visitor&& visit) {
    CameraFault::visitFields(visit);
    visit("rotation_rad", rotation_rad);
    visit("translation_m", translation_m);
  }
  void validate() const;
};

/// The plugs of two cameras are swapped: each delivers its images under the other's name.
struct SwappedCamerasFault : CameraFault {
  void validate() const;
};

/// Images that never arrive, each independently of the others.
struct DroppedImagesFault : CameraFault {
  double probability = 0.2;

  template <class Visitor>
  void visitFields(Visitor&& visit) {
    CameraFault::visitFields(visit);
    visit("probability", probability);
  }
  void validate() const;
};

/// Images with the right stamp that arrive late, each independently of the others.
struct LateImagesFault : DroppedImagesFault {
  double delay_s = 0.15;

  template <class Visitor>
  void visitFields(Visitor&& visit) {
    DroppedImagesFault::visitFields(visit);
    visit("delay_s", delay_s);
  }
  void validate() const;
};

/// Stamps that are off; images arrive when they always do.
struct ImageStampShiftFault : CameraFault {
  double shift_s = 0.02;  ///< later than the truth where positive

  template <class Visitor>
  void visitFields(Visitor&& visit) {
    CameraFault::visitFields(visit);
    visit("shift_s", shift_s);
  }
  void validate() const;
};

/// The exposure steps to a multiple of what it was.
struct ExposureStepFault : CameraFault {
  double gain = 2.5;

  template <class Visitor>
  void visitFields(Visitor&& visit) {
    CameraFault::visitFields(visit);
    visit("gain", gain);
  }
  void validate() const;
};

/// A long exposure, centred on the stamp: the mean light of renderings at equal distances of time.
struct MotionBlurFault : CameraFault {
  double exposure_time_s = 0.02;
  int renderings = 8;

  template <class Visitor>
  void visitFields(Visitor&& visit) {
    CameraFault::visitFields(visit);
    visit("exposure_time_s", exposure_time_s);
    visit("renderings", renderings);
  }
  void validate() const;
};

/// Stamps of odometry and wheel counters that are off; 0: no fault.
struct OdometryStampShiftFault : FaultInterval {
  double shift_s = 0.0;  ///< later than the truth where positive

  bool isActive() const { return shift_s != 0.0; }
  template <class Visitor>
  void visitFields(Visitor&& visit) {
    FaultInterval::visitFields(visit);
    visit("shift_s", shift_s);
  }
  void validate() const;
};

/// Both wheels count a multiple of what they should (a wrong tyre); 1: no fault.
struct OdometryScaleFault : FaultInterval {
  double factor = 1.0;

  bool isActive() const { return factor != 1.0; }
  template <class Visitor>
  void visitFields(Visitor&& visit) {
    FaultInterval::visitFields(visit);
    visit("factor", factor);
  }
  void validate() const;
};

/// One rear wheel spins or blocks: it turns by (1 + ratio) times what the road asks; 0: no fault.
struct WheelSlipFault : FaultInterval {
  enum class Wheel { kLeft, kRight };
  Wheel wheel = Wheel::kLeft;
  double ratio = 0.0;  ///< positive spins, -1 is a blocked wheel

  bool isActive() const { return ratio != 0.0; }
  template <class Visitor>
  void visitFields(Visitor&& visit) {
    visit("wheel", wheel);
    FaultInterval::visitFields(visit);
    visit("ratio", ratio);
  }
  void validate() const;
};

/// Neither counters nor odometry come in the interval; afterwards both go on with the distance in between.
/// An interval without an end: no fault.
struct MissingTicksFault : FaultInterval {
  bool isActive() const { return end_s > 0.0; }
};

/// At this time counters and dead reckoning start again from zero; 0: no fault.
struct CounterResetFault {
  double time_s = 0.0;

  bool isActive() const { return time_s > 0.0; }
  template <class Visitor>
  void visitFields(Visitor&& visit) {
    visit("time_s", time_s);
  }
  void validate() const;
};

/// The nose dives by a multiple of its angle when the car brakes, and lifts by it when the car accelerates;
/// 1: no fault.
struct SoftSuspensionFault {
  double pitch_factor = 1.0;

  bool isActive() const { return pitch_factor != 1.0; }
  template <class Visitor>
  void visitFields(Visitor&& visit) {
    visit("pitch_factor", pitch_factor);
  }
  void validate() const;
};

/// What is wrong with a drive's sensors; nothing by default. Every fault has isActive(), visitFields() and
/// validate().
struct FaultOptions {
  DeadCameraFault dead_camera;
  FrozenCameraFault frozen_camera;
  SunGlareFault sun_glare;
  DirtyLensFault dirty_lens;
  BumpedCameraFault bumped_camera;
  SwappedCamerasFault swapped_cameras;
  DroppedImagesFault dropped_images;
  LateImagesFault late_images;
  ImageStampShiftFault image_stamp_shift;
  ExposureStepFault exposure_step;
  MotionBlurFault motion_blur;
  OdometryStampShiftFault odometry_stamp_shift;
  OdometryScaleFault odometry_scale;
  WheelSlipFault wheel_slip;
  MissingTicksFault missing_ticks;
  CounterResetFault counter_reset;
  SoftSuspensionFault soft_suspension;

  template <class Visitor>
  void visitFields(Visitor&& visit) {
    visit("dead_camera", dead_camera);
    visit("frozen_camera", frozen_camera);
    visit("sun_glare", sun_glare);
    visit("dirty_lens", dirty_lens);
    visit("bumped_camera", bumped_camera);
    visit("swapped_cameras", swapped_cameras);
    visit("dropped_images", dropped_images);
    visit("late_images", late_images);
    visit("image_stamp_shift", image_stamp_shift);
    visit("exposure_step", exposure_step);
    visit("motion_blur", motion_blur);
    visit("odometry_stamp_shift", odometry_stamp_shift);
    visit("odometry_scale", odometry_scale);
    visit("wheel_slip", wheel_slip);
    visit("missing_ticks", missing_ticks);
    visit("counter_reset", counter_reset);
    visit("soft_suspension", soft_suspension);
  }
  void validate() const;  ///< throws std::invalid_argument naming the field
};

/// Name and one line about each fault, in the order of FaultOptions.
std::vector<CatalogueEntry> listFaults();

template <>
inline std::vector<std::string> enumNames<WheelSlipFault::Wheel>() {
  return {"left", "right"};
}

}  // namespace vcharge
