#pragma once

#include <string>
#include <vector>

#include "vcharge_core/base/options.h"
#include "vcharge_core/base/timestamp.h"

namespace vcharge {

/// Seconds since the start of the drive between which a fault acts: [start_s, end_s).
struct FaultInterval {
  VCHARGE_BEGIN_OPTIONS(FaultInterval);
  VCHARGE_OPTION(double, start_s, 0.0, between(0.0, 1e6),
                 "Start of the fault; 0: it acts from the beginning.");
  VCHARGE_OPTION(double, end_s, 0.0, between(0.0, 1e6), "End of the fault; 0: it does not end.");
  VCHARGE_END_OPTIONS();

  bool actsAt(Duration since_start) const;
  void checkFields() const;
};

/// A fault of cameras. It stays with the camera if the plugs of cameras are swapped.
struct CameraFault : FaultInterval {
  VCHARGE_BEGIN_DERIVED_OPTIONS(CameraFault, FaultInterval);
  VCHARGE_OPTION(std::vector<std::string>, cameras, {}, anyValue(),
                 "Cameras by name, or all; empty: no fault.");
  VCHARGE_END_OPTIONS();

  bool isActive() const { return !cameras.empty(); }
  bool actsOn(const std::string& camera) const;
  bool actsOn(const std::string& camera, Duration since_start) const {
    return actsOn(camera) && actsAt(since_start);
  }
};

struct DeadCameraFault : CameraFault {
  VCHARGE_BEGIN_DERIVED_OPTIONS(DeadCameraFault, CameraFault);
  VCHARGE_OPTION(bool, black_images, false, anyValue(), "Deliver black images instead of none.");
  VCHARGE_END_OPTIONS();
};

struct FrozenCameraFault : CameraFault {};

struct SunGlareFault : CameraFault {
  VCHARGE_BEGIN_DERIVED_OPTIONS(SunGlareFault, CameraFault);
  VCHARGE_OPTION(double, x, 0.5, between(-10.0, 10.0),
                 "Position of the sun, as a fraction of the image width.");
  VCHARGE_OPTION(double, y, 0.4, between(-10.0, 10.0),
                 "Position of the sun, as a fraction of the image height.");
  VCHARGE_END_OPTIONS();
};

/// Lamps in the image. Their glare is that of the sun (1e5 lx) scaled by their illuminance at the lens.
struct BrightLampsFault : CameraFault {
  VCHARGE_BEGIN_DERIVED_OPTIONS(BrightLampsFault, CameraFault);
  VCHARGE_OPTION(double, intensity_cd, 3000.0, between(0.0, 1e7), "Luminous intensity of each lamp.");
  VCHARGE_OPTION(std::vector<double>, positions_m, {}, between(-1e6, 1e6),
                 "Lamps at x, y, z of the world, x, y, z of the next one, and so on.");
  VCHARGE_OPTION(std::vector<double>, image_positions, {}, between(-10.0, 10.0),
                 "Lamps at x, y as fractions of the image width and height, and so on.");
  VCHARGE_OPTION(double, image_distance_m, 10.0, between(0.1, 1e4), "Distance of lamps at image_positions.");
  VCHARGE_END_OPTIONS();

  void checkFields() const;
};

/// The light of the scene, not that of lamps and sun glare. Without auto_exposure the images darken.
struct LowLightFault : FaultInterval {
  VCHARGE_BEGIN_DERIVED_OPTIONS(LowLightFault, FaultInterval);
  VCHARGE_OPTION(double, level, 1.0, positive().upTo(1.0),
                 "Light relative to the scene's own, for example 0.02; 1: no fault.");
  VCHARGE_END_OPTIONS();

  bool isActive() const { return level != 1.0; }
};

/// The lens transmits cos(a)^4 where tan(a) grows in proportion to the angle from the optical axis.
struct VignettingFault : CameraFault {
  VCHARGE_BEGIN_DERIVED_OPTIONS(VignettingFault, CameraFault);
  VCHARGE_OPTION(double, rim_loss, 0.5, notNegative().below(1.0),
                 "Fraction of the light lost at the rim of the field of view.");
  VCHARGE_END_OPTIONS();
};

/// A drop is a small lens: it shows a blurred, inverted image of its surroundings.
struct WaterDropFault : CameraFault {
  VCHARGE_BEGIN_DERIVED_OPTIONS(WaterDropFault, CameraFault);
  VCHARGE_OPTION(double, x, 0.5, between(0.0, 1.0), "Centre, as a fraction of the image width.");
  VCHARGE_OPTION(double, y, 0.5, between(0.0, 1.0), "Centre, as a fraction of the image height.");
  VCHARGE_OPTION(double, radius, 0.08, positive().upTo(0.5), "Radius, as a fraction of the image width.");
  VCHARGE_END_OPTIONS();
};

struct DirtyLensFault : CameraFault {
  VCHARGE_BEGIN_DERIVED_OPTIONS(DirtyLensFault, CameraFault);
  VCHARGE_OPTION(int, blobs, 8, between(0, 1000), "Number of soft-edged blobs of dirt on each lens.");
  VCHARGE_OPTION(double, blur_px, 0.0, between(0.0, 50.0),
                 "Standard deviation of the blur behind a blob, in pixels of a 1280x800 image.");
  VCHARGE_OPTION(int, seed, 1, notNegative(), "Seed of the positions; each camera has its own dirt.");
  VCHARGE_END_OPTIONS();
};

/// vehicle_from_camera becomes vehicle_from_camera * (rotation, translation).
struct BumpedCameraFault : CameraFault {
  VCHARGE_BEGIN_DERIVED_OPTIONS(BumpedCameraFault, CameraFault);
  VCHARGE_OPTION(std::vector<double>, rotation_rad, (std::vector<double>{0.0, 0.05, 0.0}),
                 between(-10.0, 10.0), "Rotation vector in the camera frame.");
  VCHARGE_OPTION(std::vector<double>, translation_m, std::vector<double>(3, 0.0), between(-10.0, 10.0),
                 "Translation in the camera frame.");
  VCHARGE_END_OPTIONS();

  void checkFields() const;
};

struct SwappedCamerasFault : CameraFault {
  void validate() const;
};

/// Each image is hit independently of the others.
struct DroppedImagesFault : CameraFault {
  VCHARGE_BEGIN_DERIVED_OPTIONS(DroppedImagesFault, CameraFault);
  VCHARGE_OPTION(double, probability, 0.2, between(0.0, 1.0), "Probability that an image is hit.");
  VCHARGE_END_OPTIONS();
};

struct LateImagesFault : DroppedImagesFault {
  VCHARGE_BEGIN_DERIVED_OPTIONS(LateImagesFault, DroppedImagesFault);
  VCHARGE_OPTION(double, delay_s, 0.15, positive().upTo(10.0), "Delay of the arrival; the stamp is right.");
  VCHARGE_END_OPTIONS();
};

struct ImageStampShiftFault : CameraFault {
  VCHARGE_BEGIN_DERIVED_OPTIONS(ImageStampShiftFault, CameraFault);
  VCHARGE_OPTION(std::vector<double>, shifts_s, std::vector<double>(1, 0.02), between(-10.0, 10.0),
                 "Stamp minus true time of each of the cameras, in their order, or one for all.");
  VCHARGE_OPTION(bool, moves_exposure, false, anyValue(),
                 "The shifted stamps are right: cameras have no common trigger.");
  VCHARGE_END_OPTIONS();

  static constexpr double kMaxExposureShift_s = 0.1;
  void checkFields() const;
  double shiftOf(const std::string& camera, Duration since_start) const;  ///< 0 for other cameras
  /// Exposure after the common trigger.
  double exposureShiftOf(const std::string& camera, Duration since_start) const {
    return moves_exposure ? shiftOf(camera, since_start) : 0.0;
  }
};

struct ExposureStepFault : CameraFault {
  VCHARGE_BEGIN_DERIVED_OPTIONS(ExposureStepFault, CameraFault);
  VCHARGE_OPTION(double, gain, 2.5, between(0.01, 100.0), "Exposure relative to the normal exposure.");
  VCHARGE_END_OPTIONS();
};

/// Sensor gain: it amplifies signal and noise alike.
struct CameraGainsFault : CameraFault {
  VCHARGE_BEGIN_DERIVED_OPTIONS(CameraGainsFault, CameraFault);
  VCHARGE_OPTION(std::vector<double>, gains, std::vector<double>(1, 2.0), between(0.01, 100.0),
                 "Gain of each of the cameras, in their order, or one for all.");
  VCHARGE_END_OPTIONS();

  void checkFields() const;
  double gainOf(const std::string& camera) const;  ///< 1 for other cameras
};

/// Each camera controls exposure time (0.05 to 20 ms) and then gain (1 to 16), see ExposureControl.
struct AutoExposureFault : CameraFault {
  VCHARGE_BEGIN_DERIVED_OPTIONS(AutoExposureFault, CameraFault);
  VCHARGE_OPTION(double, target_gray, 85.0, between(1.0, 250.0), "Mean gray value of the image.");
  VCHARGE_OPTION(double, time_constant_s, 0.5, between(0.0, 100.0),
                 "Time in which a deviation of the exposure falls to 1/e.");
  VCHARGE_OPTION(double, normal_time_s, 1e-3, between(5e-5, 0.02),
                 "Exposure time of the normal exposure; shorter for a more sensitive camera.");
  VCHARGE_END_OPTIONS();
};

/// Rows are exposed from top to bottom; the stamp is the middle of the exposure of the middle row.
struct RollingShutterFault : CameraFault {
  VCHARGE_BEGIN_DERIVED_OPTIONS(RollingShutterFault, CameraFault);
  VCHARGE_OPTION(double, readout_time_s, 0.02, between(0.0, 0.03),
                 "Time per row times number of rows, see Readout.");
  VCHARGE_END_OPTIONS();
};

/// An image is the mean light of renderings at equal time steps, centred on its stamp.
struct MotionBlurFault : CameraFault {
  VCHARGE_BEGIN_DERIVED_OPTIONS(MotionBlurFault, CameraFault);
  VCHARGE_OPTION(double, exposure_time_s, 0.02, positive().upTo(0.08),
                 "Exposure time, centred on the stamp.");
  VCHARGE_OPTION(int, renderings, 8, between(2, 64), "Renderings that are averaged into an image.");
  VCHARGE_END_OPTIONS();
};

/// Offset and drift of the odometry's clock against the cameras'. Order and reception of the messages stay.
struct OdometryStampShiftFault : FaultInterval {
  VCHARGE_BEGIN_DERIVED_OPTIONS(OdometryStampShiftFault, FaultInterval);
  VCHARGE_OPTION(double, shift_s, 0.0, between(-10.0, 10.0), "Stamp minus true time at start_s.");
  VCHARGE_OPTION(double, drift_ppm, 0.0, between(-1e4, 1e4),
                 "Growth of the shift, in microseconds per second.");
  VCHARGE_END_OPTIONS();

  bool isActive() const { return shift_s != 0.0 || drift_ppm != 0.0; }
  /// Stamp minus true time at a time since the start of the drive; zero outside the interval.
  Duration shiftAt(Duration since_start) const;
};

struct OdometryScaleFault : FaultInterval {
  VCHARGE_BEGIN_DERIVED_OPTIONS(OdometryScaleFault, FaultInterval);
  VCHARGE_OPTION(double, factor, 1.0, positive().upTo(10.0), "Counted over true distance; 1: no fault.");
  VCHARGE_END_OPTIONS();

  bool isActive() const { return factor != 1.0; }
};

struct WheelSlipFault : FaultInterval {
  enum class Wheel { kLeft, kRight };

  VCHARGE_BEGIN_DERIVED_OPTIONS(WheelSlipFault, FaultInterval);
  VCHARGE_OPTION(Wheel, wheel, Wheel::kLeft, anyValue(), "The rear wheel that slips.");
  VCHARGE_OPTION(double, ratio, 0.0, between(-1.0, 10.0),
                 "Additional rotation over rolled distance; -1: blocked.");
  VCHARGE_END_OPTIONS();

  bool isActive() const { return ratio != 0.0; }
};

/// After the interval the counters contain the distance driven meanwhile. Without an end, there is no fault.
struct MissingTicksFault : FaultInterval {
  bool isActive() const { return end_s > 0.0; }
};

struct CounterResetFault {
  VCHARGE_BEGIN_OPTIONS(CounterResetFault);
  VCHARGE_OPTION(double, time_s, 0.0, between(0.0, 1e6), "Time of the reset since the start; 0: no fault.");
  VCHARGE_END_OPTIONS();

  bool isActive() const { return time_s > 0.0; }
};

struct SoftSuspensionFault {
  VCHARGE_BEGIN_OPTIONS(SoftSuspensionFault);
  VCHARGE_OPTION(double, pitch_factor, 1.0, between(0.0, 50.0), "Factor on the pitch angle; 1: no fault.");
  VCHARGE_END_OPTIONS();

  bool isActive() const { return pitch_factor != 1.0; }
};

/// No fault of a sensor, but the cameras see the ground otherwise. The body stays where it is over the front
/// axle.
struct LoadedBootFault : FaultInterval {
  VCHARGE_BEGIN_DERIVED_OPTIONS(LoadedBootFault, FaultInterval);
  VCHARGE_OPTION(double, pitch_rad, 0.0, between(0.0, 0.1), "Nose up; 0: no load.");
  VCHARGE_END_OPTIONS();

  bool isActive() const { return pitch_rad != 0.0; }
};

/// Faults of the sensors of a drive; none by default. Every fault has isActive().
struct FaultOptions {
  VCHARGE_BEGIN_OPTIONS(FaultOptions);
  VCHARGE_OPTION_GROUP(DeadCameraFault, dead_camera, {}, "Cameras deliver no images, or black ones.");
  VCHARGE_OPTION_GROUP(FrozenCameraFault, frozen_camera, {},
                       "Cameras repeat their last image with new stamps.");
  VCHARGE_OPTION_GROUP(SunGlareFault, sun_glare, {},
                       "A low sun in the image: a white disk and veiling glare.");
  VCHARGE_OPTION_GROUP(BrightLampsFault, bright_lamps, {},
                       "Lamps in the image: saturated disks and veiling glare.");
  VCHARGE_OPTION_GROUP(LowLightFault, low_light, {}, "Less light than by day.");
  VCHARGE_OPTION_GROUP(VignettingFault, vignetting, {}, "Lenses transmit less light towards the rim.");
  VCHARGE_OPTION_GROUP(WaterDropFault, water_drop, {}, "A drop of water on the lens.");
  VCHARGE_OPTION_GROUP(DirtyLensFault, dirty_lens, {},
                       "A bright line and dirt blobs at fixed image positions.");
  VCHARGE_OPTION_GROUP(BumpedCameraFault, bumped_camera, {}, "A bump rotates and moves cameras.");
  VCHARGE_OPTION_GROUP(SwappedCamerasFault, swapped_cameras, {},
                       "Two cameras deliver under each other's name.");
  VCHARGE_OPTION_GROUP(DroppedImagesFault, dropped_images, {}, "Images are lost at random.");
  VCHARGE_OPTION_GROUP(LateImagesFault, late_images, {},
                       "Images with the right stamp arrive late, at random.");
  VCHARGE_OPTION_GROUP(ImageStampShiftFault, image_stamp_shift, {}, "Stamps of cameras are wrong.");
  VCHARGE_OPTION_GROUP(ExposureStepFault, exposure_step, {}, "The exposure changes abruptly.");
  VCHARGE_OPTION_GROUP(CameraGainsFault, camera_gains, {}, "Cameras have different gains.");
  VCHARGE_OPTION_GROUP(AutoExposureFault, auto_exposure, {}, "Cameras control exposure time and gain.");
  VCHARGE_OPTION_GROUP(RollingShutterFault, rolling_shutter, {}, "Rows are exposed one after the other.");
  VCHARGE_OPTION_GROUP(MotionBlurFault, motion_blur, {}, "Long exposures blur the images.");
  VCHARGE_OPTION_GROUP(OdometryStampShiftFault, odometry_stamp_shift, {},
                       "The clock of odometry and ticks is off or drifts.");
  VCHARGE_OPTION_GROUP(OdometryScaleFault, odometry_scale, {}, "Both wheels count too much or too little.");
  VCHARGE_OPTION_GROUP(WheelSlipFault, wheel_slip, {}, "A rear wheel spins (ratio above 0) or blocks (-1).");
  VCHARGE_OPTION_GROUP(MissingTicksFault, missing_ticks, {},
                       "Neither ticks nor odometry from start_s to end_s.");
  VCHARGE_OPTION_GROUP(CounterResetFault, counter_reset, {},
                       "Wheel counters and odometry restart from zero.");
  VCHARGE_OPTION_GROUP(SoftSuspensionFault, soft_suspension, {},
                       "The body pitches more on brakes and throttle.");
  VCHARGE_OPTION_GROUP(LoadedBootFault, loaded_boot, {}, "A load tilts and lowers the body.");
  VCHARGE_END_OPTIONS();
};

template <>
inline std::vector<std::string> enumNames<WheelSlipFault::Wheel>() {
  return {"left", "right"};
}

}  // namespace vcharge
