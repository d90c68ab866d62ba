#include "vcharge_simulation/scenes/scene_catalogue.h"

#include <stdexcept>

#include "scenes/board/board_pattern.h"
#include "scenes/scene_builders.h"
#include "vcharge_core/base/error.h"

namespace vcharge {

namespace {

struct CatalogueScene {
  CatalogueEntry entry;
  std::shared_ptr<const Scene> (*build)(const SceneOptions&);
  std::function<std::vector<SceneDrive>(uint64_t layout_seed)> drives;
  bool has_movers = false;   ///< knows SceneOptions::movers
  bool has_layouts = false;  ///< knows SceneOptions::layout_seed
};

const std::vector<CatalogueScene>& catalogue() {
  static const std::vector<CatalogueScene> scenes = {
      {{"lot", "sunlit parking lot of 80 x 60 m"}, buildLotScene, lotDrives, true, true},
      {{"garage", "underground garage of 64 x 47 m, lit by lamps"},
       buildGarageScene,
       garageDrives,
       true,
       true},
      {{"obstacles", "posts, boxes, kerbs, a trailer and two people on the lot"},
       buildCourseScene,
       [](uint64_t) { return courseDrives(); },
       true},
      {{"steps", "kerbs of 5 to 12 cm, holes and speed bumps on the lot"},
       buildStepsScene,
       [](uint64_t) { return stepsDrives(); }},
      {{"two_levels", "lot on two levels with ramps of 6 degrees and uneven ground"},
       buildTwoLevelsScene,
       [](uint64_t) { return twoLevelsDrives(); }},
      {{"ramp", "helical ramp of 9 m radius, 10 % and 1.25 turns on the lot"},
       buildRampScene,
       [](uint64_t) { return rampDrives(); }},
      {{"road", "straight road with parked cars and houses, then speed bumps and a slope of 5 %"},
       buildRoadScene,
       [](uint64_t) { return roadDrives(); },
       true},
      {{"chessboard", "chessboard or AprilGrid (--board) in front of each camera in turn, on the lot"},
       buildBoardScene,
       [](uint64_t) { return boardDrives(); }}};
  return scenes;
}

template <class Entries>
std::vector<CatalogueEntry> entriesOf(const Entries& things) {
  std::vector<CatalogueEntry> entries;
  for (const auto& thing : things) {
    entries.push_back(thing.entry);
  }
  return entries;
}

std::string namesOf(const std::vector<CatalogueEntry>& entries) {
  std::string names;
  for (const CatalogueEntry& entry : entries) {
    names += (names.empty() ? "" : ", ") + entry.name;
  }
  return names;
}

void checkLayout(const CatalogueScene& scene, uint64_t layout_seed) {
  if (layout_seed != 0 && !scene.has_layouts) {
    throw std::invalid_argument("layout_seed: the scene " + scene.entry.name + " has one layout, 0");
  }
}

const CatalogueScene& findScene(const std::string& name) {
  for (const CatalogueScene& scene : catalogue()) {
    if (scene.entry.name == name) {
      return scene;
    }
  }
  throw std::invalid_argument("scene: expected one of " + namesOf(listScenes()) + ", got '" + name + "'");
}

}  // namespace

std::string boardTarget(const std::string& board) {
  return makeBoardPattern(board).target_yaml;
}

std::vector<CatalogueEntry> listScenes() {
  return entriesOf(catalogue());
}

std::vector<CatalogueEntry> listDrives(const std::string& scene) {
  return entriesOf(findScene(scene).drives(0));
}

std::shared_ptr<const Scene> buildScene(const std::string& name, const SceneOptions& options) {
  check(options.image_scale > 0.0 && options.detail > 0.0,
        "buildScene: image_scale and detail must be positive");
  const CatalogueScene& scene = findScene(name);
  if (options.movers.hasAny() && !scene.has_movers) {
    throw std::invalid_argument("movers: the scene " + name + " has none");
  }
  checkLayout(scene, options.layout_seed);
  return scene.build(options);
}

DrivePlan planDrive(const std::string& scene, const std::string& drive, uint64_t layout_seed) {
  checkLayout(findScene(scene), layout_seed);
  for (const SceneDrive& known : findScene(scene).drives(layout_seed)) {
    if (known.entry.name == drive) {
      DrivePlan plan = known.plan();
      plan.name = drive;
      return plan;
    }
  }
  throw std::invalid_argument("drive: expected one of " + namesOf(listDrives(scene)) + " in the scene " +
                              scene + ", got '" + drive + "'");
}

}  // namespace vcharge
