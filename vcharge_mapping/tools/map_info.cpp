#include <algorithm>
#include <cstdio>

#include "vcharge_core/base/command_line.h"
#include "vcharge_core/sparse_map/sparse_map_file.h"
#include "vcharge_mapping/map_description.h"

namespace {

nlohmann::json toJson(const vcharge::SparseMap& map, const vcharge::MapProvenance& provenance) {
  nlohmann::json cameras = nlohmann::json::array();
  for (size_t i = 0; i < map.rig().cameras.size(); ++i) {
    const vcharge::ReprojectionErrors errors = vcharge::measureReprojection(map, i);
    cameras.push_back({{"name", map.rig().cameras[i].name},
                       {"num_observations", errors.num_observations},
                       {"rms_px", errors.rms_px}});
  }
  const auto& edges = map.contents().loop_edges;
  const auto num_accepted = std::count_if(edges.begin(), edges.end(),
                                          [](const vcharge::MapLoopEdge& edge) { return edge.accepted; });
  nlohmann::json sessions = nlohmann::json::array();
  for (const vcharge::MapSession& session : map.sessions()) {
    sessions.push_back({{"name", session.name}, {"component", session.component}});
  }
  return {{"sessions", sessions},
          {"num_keyframes", map.keyframes().size()},
          {"num_landmarks", map.landmarks().size()},
          {"num_observations", map.observations().size()},
          {"num_loop_edges", num_accepted},
          {"cameras", cameras},
          {"provenance", provenance},
          {"content_hash", map.contentHash()}};
}

}  // namespace

int main(int argc, char** argv) {
  vcharge::CommandLine app("Describes a sparse map and writes the poses of its keyframes.");
  std::string map_path, trajectory_path;
  bool list_loop_edges = false;
  app.addOption("--map", &map_path, "the map (*.vmap)").required().check(vcharge::requireNotEmpty);
  app.addFlag("--loop-edges", &list_loop_edges, "name every loop edge");
  app.addOption("--trajectory", &trajectory_path, "keyframe poses as TUM text").check(vcharge::requireOutput);
  app.setFooter(
      "Keys of --json: sessions (name, component), num_keyframes, num_landmarks, num_observations, "
      "num_loop_edges (accepted), cameras "
      "(name, num_observations, rms_px), provenance, content_hash.");
  return vcharge::runTool(&app, argc, argv, [&](nlohmann::json* found) {
    vcharge::MapProvenance provenance;
    const auto map = vcharge::readSparseMap(map_path, &provenance);
    std::fputs(vcharge::describeMap(*map, provenance, list_loop_edges).c_str(), stdout);
    *found = toJson(*map, provenance);
    if (!trajectory_path.empty()) {
      vcharge::writeTrajectory(vcharge::trajectoryOf(*map), trajectory_path);
      std::printf("written: %s\n", trajectory_path.c_str());
    }
  });
}
