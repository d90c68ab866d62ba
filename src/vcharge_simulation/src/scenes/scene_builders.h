#pragma once

#include <functional>
#include <memory>
#include <string>
#include <vector>

#include "vcharge_simulation/scenes/scene_catalogue.h"

namespace vcharge {

/// A drive of a scene; `plan` leaves the name of the plan empty.
struct SceneDrive {
  CatalogueEntry entry;
  std::function<DrivePlan()> plan;
};

/// An outdoor parking lot of 80 x 60 m: lanes of asphalt and cobbles around two double rows of bays, parked
/// cars, trees, hedges, kerbs, posts and fences, with houses around it.
std::shared_ptr<const Scene> buildLotScene(const SceneOptions& options);
std::vector<SceneDrive> lotDrives(uint64_t layout_seed);

/// An underground garage of 64 x 47 m, lit by lamps: lanes around rows of bays between numbered pillars,
/// parked cars, beams and pipes.
std::shared_ptr<const Scene> buildGarageScene(const SceneOptions& options);
std::vector<SceneDrive> garageDrives(uint64_t layout_seed);

/// A straight road of 400 m with kerbs, pavements, parked cars and houses, then speed bumps and a slope.
std::shared_ptr<const Scene> buildRoadScene(const SceneOptions& options);
std::vector<SceneDrive> roadDrives();

/// The lot with small obstacles in its middle lane, a standing and a walking person.
std::shared_ptr<const Scene> buildCourseScene(const SceneOptions& options);
std::vector<SceneDrive> courseDrives();

/// The lot with kerbs of 5, 8 and 12 cm, holes, and bumps with ramps along its middle lane.
std::shared_ptr<const Scene> buildStepsScene(const SceneOptions& options);
std::vector<SceneDrive> stepsDrives();

/// The lot with its northern half raised behind a wall, ramps of 6 degrees in the east and in the west, and
/// slightly uneven ground.
std::shared_ptr<const Scene> buildTwoLevelsScene(const SceneOptions& options);
std::vector<SceneDrive> twoLevelsDrives();
/// Height of the drivable ground: levels, ramps and bumps.
double twoLevelsGroundHeight(double x_m, double y_m);

/// The lot with a helical ramp in its middle (see ramp_shape.h) that leads to a landing above its first turn.
/// Where levels lie over each other, height maps hold the uppermost.
std::shared_ptr<const Scene> buildRampScene(const SceneOptions& options);
std::vector<SceneDrive> rampDrives();

/// The lot with a calibration board (options.board) held in front of each camera of the standing car in turn,
/// at many poses out to the rim of the image. The poses fit the cameras of options.rig; the mover's pose is
/// that of the pattern frame (see BoardPattern).
std::shared_ptr<const Scene> buildBoardScene(const SceneOptions& options);
std::vector<SceneDrive> boardDrives();

}  // namespace vcharge
