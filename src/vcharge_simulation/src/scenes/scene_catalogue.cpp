#include "vcharge_simulation/scenes/scene_catalogue.h"

#include <algorithm>
#include <functional>
#include <stdexcept>

#include "scenes/board/board_pattern.h"
#include "scenes/board/board_scene.h"
#include "scenes/course_scene.h"
#include "scenes/garage/garage_scene.h"
#include "scenes/garage/two_levels_scene.h"
#include "scenes/lot/lot_scene.h"
#include "vcharge_core/base/error.h"

namespace vcharge {

namespace {

struct CatalogueScene {
  CatalogueEntry entry;
  std::function<std::shared_ptr<const Scene>(const SceneOptions&)> build;
  std::function<std::vector<CatalogueEntry>()> drives;
  std::function<DrivePlan(const std::string&)> plan;
};

const std::vector<CatalogueScene>& catalogue() {
  static const std::vector<CatalogueScene> scenes = {
      {{"lot", "parking lot of 80 x 60 m in the sun"}, buildLotScene, listLotDrives, planLotDrive},
      {{"garage", "underground garage of 64 x 47 m, lit by lamps"},
       buildGarageScene,
       listGarageDrives,
       planGarageDrive},
      {{"obstacles", "course of posts, boxes, kerbs, a trailer and people on the lot"},
       buildCourseScene,
       listCourseDrives,
       planCourseDrive},
      {{"two_levels", "lot on two levels with ramps of 6 degrees and uneven ground"},
       buildTwoLevelsScene,
       listTwoLevelsDrives,
       planTwoLevelsDrive},
      {{"chessboard", "chessboard or AprilGrid (--board) held before each camera in turn, on the lot"},
       buildBoardScene,
       listBoardDrives,
       planBoardDrive}};
  return scenes;
}

std::string namesOf(const std::vector<CatalogueEntry>& entries) {
  std::string names;
  for (const CatalogueEntry& entry : entries) {
    names += (names.empty() ? "" : ", ") + entry.name;
  }
  return names;
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
  std::vector<CatalogueEntry> entries;
  for (const CatalogueScene& scene : catalogue()) {
    entries.push_back(scene.entry);
  }
  return entries;
}

std::vector<CatalogueEntry> listDrives(const std::string& scene) {
  return findScene(scene).drives();
}

std::shared_ptr<const Scene> buildScene(const std::string& name, const SceneOptions& options) {
  check(options.image_scale > 0.0 && options.detail > 0.0,
        "buildScene: image_scale and detail must be positive");
  return findScene(name).build(options);
}

DrivePlan planDrive(const std::string& scene, const std::string& drive) {
  const CatalogueScene& found = findScene(scene);
  const std::vector<CatalogueEntry> drives = found.drives();
  if (std::none_of(drives.begin(), drives.end(),
                   [&](const CatalogueEntry& entry) { return entry.name == drive; })) {
    throw std::invalid_argument("drive: expected one of " + namesOf(drives) + " in the scene " + scene +
                                ", got '" + drive + "'");
  }
  return found.plan(drive);
}

}  // namespace vcharge
