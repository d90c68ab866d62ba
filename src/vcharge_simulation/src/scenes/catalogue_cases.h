#pragma once

#include <string>

#include "vcharge_core/motion/rigid_transform.h"
#include "vcharge_simulation/rendering/renderer.h"

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
                                            {"two_levels", "up_and_down", 100},
                                            {"chessboard", "board_front", 30}};

/// Renderer of a scene that is quick to build and sharp enough for small images; built once per process.
const Renderer& rendererOf(const std::string& scene);

/// Vehicle pose and scene time of a case, optionally some frames later.
struct Moment {
  RigidTransform world_from_vehicle;
  double time_s;
};
Moment momentOf(const SceneCase& scene_case, int later_frames = 0);

}  // namespace vcharge
