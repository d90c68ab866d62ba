#pragma once

#include <string>
#include <vector>

#include "vcharge_core/base/options.h"
#include "vcharge_simulation/faults/fault_options.h"
#include "vcharge_simulation/scenes/conditions.h"
#include "vcharge_simulation/scenes/mover_options.h"
#include "vcharge_simulation/sensors/lens_blur.h"
#include "vcharge_simulation/sensors/wheel_odometer.h"

namespace vcharge {

/// Body of the car that carries the cameras: dark paint that reflects a smooth sky and ground; nothing; or
/// paint of any brightness that reflects the scene, with mirror housings beside the cameras and soft edges.
enum class BodyKind { kPlain, kNone, kGlossy };

template <>
inline std::vector<std::string> enumNames<BodyKind>() {
  return {"plain", "none", "glossy"};
}

/// Everything that determines a simulated drive. The same scenario gives the same bytes.
struct DriveScenario {
  VCHARGE_BEGIN_OPTIONS(DriveScenario);
  VCHARGE_OPTION(std::string, scene, "lot", anyValue(), "Name of the scene, see --list.");
  VCHARGE_OPTION(std::string, drive, "short", anyValue(), "Name of the drive in the scene, see --list.");
  VCHARGE_OPTION(std::string, rig, "golf", anyValue(), "Name of the rig, see --list.");
  VCHARGE_OPTION(BodyKind, body, BodyKind::kPlain, anyValue(), "Body of the car that carries the cameras.");
  VCHARGE_OPTION(std::string, board, "chessboard", anyValue(),
                 "Board in the scene chessboard: chessboard or aprilgrid.");
  VCHARGE_OPTION(int, scene_seed, 1, notNegative(), "Seed of the scene.");
  VCHARGE_OPTION(
      int, layout_seed, 0, notNegative(),
      "Seed of the plan of lot or garage: bays, aisles, kerbs, walls, pillars; 0: the known plan.");
  VCHARGE_OPTION(
      int, surface_seed, 0, notNegative(),
      "Seed of grain, relief and contrast of surfaces and of foliage, as in real images; 0: smooth, dense.");
  VCHARGE_OPTION(int, rig_seed, 1, notNegative(), "Seed of lenses and mountings.");
  VCHARGE_OPTION(int, day, -1, atLeast(-1), "Day, with its light and parked cars; -1: that of the drive.");
  VCHARGE_OPTION(double, exchanged_cars, -1.0, between(-1.0, 1.0),
                 "Fraction of the bays whose cars differ from day 0; negative: 0.3, on day 0 none.");
  VCHARGE_OPTION(int, seed, 1, notNegative(), "Seed of the road roughness, and by default of the sensors.");
  VCHARGE_OPTION(int, sensor_seed, -1, atLeast(-1), "Seed of wheels and image noise; -1: the same as seed.");
  VCHARGE_OPTION(double, duration_s, 0.0, between(0.0, 1e6), "End of the drive; 0: the end of its path.");
  VCHARGE_OPTION(double, image_scale, 1.0, between(0.05, 1.0), "Image size relative to 1280x800.");
  VCHARGE_OPTION(int, image_step, 1, atLeast(1), "Keep every n-th of the 12.5 images per second.");
  VCHARGE_OPTION(double, exposure_gain, 1.0, between(0.01, 100.0),
                 "Exposure relative to the normal exposure.");
  VCHARGE_OPTION(bool, noise, true, anyValue(), "Add sensor noise to the images.");
  VCHARGE_OPTION(std::vector<std::string>, cameras, {}, anyValue(),
                 "Cameras to record, by name; empty: all.");
  VCHARGE_OPTION_GROUP(ConditionOptions, condition, {}, "Light and weather.");
  VCHARGE_OPTION_GROUP(MoverOptions, movers, {}, "Objects that move through the scene.");
  VCHARGE_OPTION_GROUP(WheelOdometerOptions, odometer, {}, "Errors of the wheel odometer.");
  VCHARGE_OPTION_GROUP(LensOptions, lens, {}, "Blur of the lenses.");
  VCHARGE_OPTION_GROUP(FaultOptions, faults, {}, "Faults of sensors, wheels and suspension.");
  VCHARGE_END_OPTIONS();

  /// `faults` with automatic exposure of all cameras in any condition but noon.
  FaultOptions activeFaults() const {
    FaultOptions active = faults;
    if (!condition.isNoon() && !active.auto_exposure.isActive()) {
      active.auto_exposure.cameras = {"all"};
      active.auto_exposure.normal_time_s = 1e-4;  // of a lens fast enough for the night
    }
    return active;
  }
  uint64_t sensorSeed() const { return static_cast<uint64_t>(sensor_seed < 0 ? seed : sensor_seed); }
};

}  // namespace vcharge
