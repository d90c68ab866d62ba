#pragma once

#include <memory>
#include <string>
#include <vector>

#include "vcharge_simulation/scenes/scene.h"
#include "vcharge_simulation/vehicle/drive_path.h"
#include "vcharge_simulation/vehicle/vehicle_motion.h"

namespace vcharge {

/// How a scene of the catalogue is built.
struct SceneOptions {
  int seed = 1;             ///< of everything that stays from day to day
  int day = 0;              ///< another day: other light and moved cars
  double moved_cars = 0.3;  ///< share of the parked cars that differ from day 0
  /// Size of the images that will be rendered, over 1280x800: smaller images need no finer textures.
  double image_scale = 1.0;
  /// Leaves and light maps over the default: less is quicker to build, for tests.
  double detail = 1.0;
  /// Of the scene "chessboard": what is held ("chessboard" or "aprilgrid"), and for the cameras of which rig.
  std::string board = "chessboard";
  std::string rig = "golf";
  int rig_seed = 1;
  void validate() const;  ///< throws std::invalid_argument naming the field
};

/// Kalibr target file of SceneOptions::board. Throws std::invalid_argument for an unknown board.
std::string boardTarget(const std::string& board);

/// A drive in a scene.
struct DrivePlan {
  std::string name;
  DrivePath path;
  VehicleMotionOptions motion;
  int day = 0;                           ///< SceneOptions::day of the drive
  GroundHeight ground_height = nullptr;  ///< ground of the scene; null: level at z = 0
  double start_s = 0.0;                  ///< scene time at the start of the drive
};

/// Name and one-line description of a scene, drive, rig or fault.
struct CatalogueEntry {
  std::string name, description;
};
std::vector<CatalogueEntry> listScenes();
std::vector<CatalogueEntry> listDrives(const std::string& scene);

/// Both throw std::invalid_argument that lists the known names for an unknown one. The same options give the
/// same scene.
std::shared_ptr<const Scene> buildScene(const std::string& name, const SceneOptions& options);
DrivePlan planDrive(const std::string& scene, const std::string& drive);

}  // namespace vcharge
