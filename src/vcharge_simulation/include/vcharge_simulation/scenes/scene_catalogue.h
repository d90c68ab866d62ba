#pragma once

#include <cstdint>
#include <memory>
#include <string>
#include <vector>

#include "vcharge_simulation/scenes/conditions.h"
#include "vcharge_simulation/scenes/mover_options.h"
#include "vcharge_simulation/scenes/scene.h"
#include "vcharge_simulation/vehicle/drive_path.h"
#include "vcharge_simulation/vehicle/vehicle_motion.h"

namespace vcharge {

/// Days differ in light and in some of the parked cars.
struct Day {
  static constexpr double kExchangedCars = 0.3;
  int number = 0;
  double exchanged_cars = -1.0;  ///< fraction of the bays; negative: kExchangedCars, none on day 0

  Day(int day = 0, double exchanged = -1.0) : number(day), exchanged_cars(exchanged) {}  // NOLINT: implicit
  double exchangedCars() const {
    return exchanged_cars >= 0.0 ? exchanged_cars : (number != 0 ? kExchangedCars : 0.0);
  }
};

/// How a scene is built.
struct SceneOptions {
  uint64_t seed = 1;  ///< selects everything that does not change between days
  Day day;
  ConditionOptions condition;
  uint64_t layout_seed = 0;   ///< plan of lot or garage; 0: the known one
  uint64_t surface_seed = 0;  ///< see SurfaceVariety
  double image_scale = 1.0;   ///< size of the rendered images relative to 1280x800: coarser textures for less
  double detail = 1.0;  ///< number of leaves and resolution of light maps; lower values are built faster
  /// For the scene "chessboard": the board ("chessboard" or "aprilgrid") and the rig that it is shown to.
  std::string board = "chessboard";
  std::string rig = "golf";
  uint64_t rig_seed = 1;
  /// Movers of the scenes lot, garage, obstacles and road. They depend on the drive: `own_poses` are
  /// world_from_vehicle every 0.1 s from the scene time `start_s` on (see ownPoses()).
  MoverOptions movers;
  std::vector<RigidTransform> own_poses;
  double start_s = 0.0;
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

/// Both throw std::invalid_argument that lists the known names for an unknown one, and if movers are wanted
/// in a scene that has none, or a
/// layout in a scene that has a single one. The same options give the same scene.
std::shared_ptr<const Scene> buildScene(const std::string& name, const SceneOptions& options);
DrivePlan planDrive(const std::string& scene, const std::string& drive, uint64_t layout_seed = 0);

}  // namespace vcharge
