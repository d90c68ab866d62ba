#pragma once

#include <memory>
#include <set>
#include <string>

#include "vcharge_core/motion/rigid_transform.h"
#include "vcharge_simulation/drive/truth_maps.h"
#include "vcharge_simulation/rendering/renderer.h"
#include "vcharge_simulation/scenes/scene_catalogue.h"

namespace vcharge {

/// A scene of the catalogue with the drive and frame at which tests render it.
struct SceneCase {
  const char* scene;
  const char* drive;
  int frame;
};
inline constexpr SceneCase kSceneCases[] = {{"lot", "short", 10},
                                            {"garage", "short", 10},
                                            {"obstacles", "creep", 100},
                                            {"steps", "pass", 100},
                                            {"two_levels", "up_and_down", 100},
                                            {"road", "bumps", 100},
                                            {"ramp", "up", 200},
                                            {"chessboard", "board_front", 30}};

/// Renderer of a scene that is quick to build and sharp enough for small images; built once per process.
const Renderer& rendererOf(const std::string& scene);

/// Vehicle pose and scene time of a case, optionally some frames later.
struct Moment {
  RigidTransform world_from_vehicle;
  double time_s;
};
Moment momentOf(const SceneCase& scene_case, int later_frames = 0);

/// Level ground at z = 0, 1 km wide, under the default sky.
std::shared_ptr<const Scene> planeScene();
/// Expects that the ranges of the plane scene at every pixel of `view` follow the formula.
void expectRangesOfPlane(const CameraView& view, const RigidTransform& world_from_vehicle);

/// Cells of a height map that stand out of the ground by 0.3 to 1.4 m, and those of them that are on no
/// obstacle's footprint, dilated by 3 cells for leaves and mirrors. `border_cells` at the border are left
/// out.
struct StandingCells {
  int all = 0, unexplained = 0;
};
StandingCells findStandingCells(const Scene& scene, const TruthHeightMap& map, int border_cells = 0);
double groundAt(const Scene& scene, const Eigen::Vector2d& position_m);
/// Obstacles that the own car would touch on a drive.
std::set<std::string> touchedOn(const DrivePlan& plan, const std::vector<Obstacle>& obstacles);
/// Mean of the corners of a footprint.
Eigen::Vector2d middleOf(const Obstacle& obstacle);

}  // namespace vcharge
