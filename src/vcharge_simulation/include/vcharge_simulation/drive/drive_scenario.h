#pragma once

#include <string>
#include <vector>

#include "vcharge_simulation/drive/drive_simulator.h"
#include "vcharge_simulation/faults/fault_options.h"
#include "vcharge_simulation/sensors/camera_response.h"
#include "vcharge_simulation/sensors/lens_blur.h"
#include "vcharge_simulation/sensors/wheel_odometer.h"

namespace vcharge {

/// All that a simulated drive depends on. The same scenario gives the same bytes.
struct DriveScenario {
  std::string scene = "lot";
  std::string drive = "short";
  std::string rig = "golf";
  std::string board = "chessboard";  ///< or aprilgrid: what the scene chessboard shows
  int scene_seed = 1;                ///< of the scene
  int rig_seed = 1;                  ///< of the lenses and how they are mounted
  int seed = 1;                      ///< of the road under the car
  int sensor_seed = -1;              ///< of wheels and image noise; negative: as `seed`
  double duration_s = 0.0;           ///< the drive ends early; 0: where its path ends
  double image_scale = 1.0;          ///< image size over 1280x800
  int image_step = 1;                ///< only every so many of the 12.5 images a second
  double exposure_gain = 1.0;        ///< of the images over the camera's normal exposure
  bool noise = true;
  std::vector<std::string> cameras;  ///< by name; empty: all
  WheelOdometerOptions odometer;
  LensOptions lens;
  CameraResponseOptions response;
  FaultOptions faults;

  template <class Visitor>
  void visitFields(Visitor&& visit) {
    visit("scene", scene);
    visit("drive", drive);
    visit("rig", rig);
    visit("board", board);
    visit("scene_seed", scene_seed);
    visit("rig_seed", rig_seed);
    visit("seed", seed);
    visit("sensor_seed", sensor_seed);
    visit("duration_s", duration_s);
    visit("image_scale", image_scale);
    visit("image_step", image_step);
    visit("exposure_gain", exposure_gain);
    visit("noise", noise);
    visit("cameras", cameras);
    visit("odometer", odometer);
    visit("lens", lens);
    visit("response", response);
    visit("faults", faults);
  }
  void validate() const;  ///< throws std::invalid_argument naming the field

  uint64_t sensorSeed() const { return static_cast<uint64_t>(sensor_seed < 0 ? seed : sensor_seed); }
};

}  // namespace vcharge
