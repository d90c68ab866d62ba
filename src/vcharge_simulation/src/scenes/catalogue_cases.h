#pragma once

#include <string>

#include "vcharge_core/motion/rigid_transform.h"
#include "vcharge_simulation/rendering/renderer.h"

namespace vcharge {

/// A scene of the catalogue, and where and when tests look at it.
struct SceneCase {
  const char* scene;
  const char* drive;
  int frame;
};
inline constexpr SceneCase kSceneCases[] = {{"lot", "short", 10},
                                            {"garage", "short", 10},
                                            {"obstacles", "creep", 100},
                                            {"two_levels", "up_and_down", 100},
                                            {"chessboard", "board_front", 30}};

/// A scene of the catalogue, sharp enough for small images and quick to build; it is built once.
const Renderer& rendererOf(const std::string& scene);

/// Where the case's vehicle is, and the time of the scene's movers, some frames later than its own.
struct Moment {
  RigidTransform world_from_vehicle;
  double time_s;
};
Moment momentOf(const SceneCase& scene_case, int later_frames = 0);

}  // namespace vcharge
