#include <cstdio>

#include "vcharge_core/base/command_line.h"
#include "vcharge_core/sparse_map/sparse_map_file.h"
#include "vcharge_mapping/map_description.h"

int main(int argc, char** argv) {
  CLI::App app("Describes a sparse map and writes the poses of its keyframes.");
  std::string map_path, trajectory_path;
  bool list_loop_edges = false;
  app.add_option("--map", map_path, "the map (*.vmap)")->required()->check(vcharge::requireNotEmpty);
  app.add_flag("--loop-edges", list_loop_edges, "name every loop edge");
  app.add_option("--trajectory", trajectory_path, "keyframe poses as TUM text")
      ->check(vcharge::requireNotEmpty);
  return vcharge::runTool(&app, argc, argv, [&] {
    vcharge::MapProvenance provenance;
    const auto map = vcharge::readSparseMap(map_path, &provenance);
    std::fputs(vcharge::describeMap(*map, provenance, list_loop_edges).c_str(), stdout);
    if (!trajectory_path.empty()) {
      vcharge::writeTrajectory(vcharge::trajectoryOf(*map), trajectory_path);
      std::printf("written: %s\n", trajectory_path.c_str());
    }
  });
}
