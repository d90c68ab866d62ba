#include <cstdio>
#include <optional>
#include <string>
#include <vector>

#include "vcharge_core/base/command_line.h"
#include "vcharge_core/base/error.h"
#include "vcharge_core/files/file_io.h"
#include "vcharge_core/sparse_map/sparse_map_file.h"
#include "vcharge_mapping/map_difference.h"

namespace {

using namespace vcharge;

void print(const MapDifference& difference, int64_t from, int64_t to) {
  std::printf("version %lld to %lld\n", static_cast<long long>(from), static_cast<long long>(to));
  for (const std::string& name : difference.new_sessions) {
    std::printf("new session    %s\n", name.c_str());
  }
  for (const std::string& name : difference.lost_sessions) {
    std::printf("lost session   %s\n", name.c_str());
  }
  std::printf("keyframes      %zu new, %zu lost\n", difference.num_new_keyframes,
              difference.num_lost_keyframes);
  std::printf(
      "landmarks      %zu appeared, %zu vanished, %zu moved; %zu are in both, moved by %.4f m "
      "(median)\n",
      difference.count(LandmarkChange::Kind::kAppeared), difference.count(LandmarkChange::Kind::kVanished),
      difference.count(LandmarkChange::Kind::kMoved), difference.num_common_landmarks,
      difference.median_move_m);
}

}  // namespace

int main(int argc, char** argv) {
  CommandLine app("Shows what changed between two versions of a map.");
  std::string path, output;
  std::optional<int64_t> from, to;
  double min_move_m = 0.1;
  app.addOption("--map", &path, "the map (*.vmap)").required().check(requireNotEmpty);
  app.addOption("--from", &from, "earlier version (default: the one before the newest)");
  app.addOption("--to", &to, "later version (default: the newest)");
  app.addOption("--min-move-m", &min_move_m, "least distance by which a landmark moved")
      .notNegative()
      .showDefault();
  app.addOption("--output", &output, "CSV of the changed landmarks: change, id, x_m, y_m, z_m, moved_by_m")
      .check(requireOutput);
  app.setFooter(
      "Keys of --json: from, to, new_sessions, lost_sessions, num_new_keyframes, num_lost_keyframes, "
      "num_appeared, num_vanished, num_moved, num_common_landmarks, median_move_m.");
  return runTool(&app, argc, argv, [&](nlohmann::json* found) {
    const std::vector<MapVersion> versions = readMapVersions(path);
    if (!from && versions.size() < 2) {
      throw InputError(path + ": expected two versions, holds one");
    }
    const int64_t later = to.value_or(versions.back().number);
    const int64_t earlier = from ? *from : versions[versions.size() - 2].number;
    const MapDifference difference = compareVersions(*readSparseMap(path, nullptr, earlier),
                                                     *readSparseMap(path, nullptr, later), min_move_m);
    print(difference, earlier, later);
    if (!output.empty()) {
      writeTextFileAtomically(output, toCsv(difference));
      std::printf("written: %s\n", output.c_str());
    }
    *found = {{"from", earlier},
              {"to", later},
              {"new_sessions", difference.new_sessions},
              {"lost_sessions", difference.lost_sessions},
              {"num_new_keyframes", difference.num_new_keyframes},
              {"num_lost_keyframes", difference.num_lost_keyframes},
              {"num_appeared", difference.count(LandmarkChange::Kind::kAppeared)},
              {"num_vanished", difference.count(LandmarkChange::Kind::kVanished)},
              {"num_moved", difference.count(LandmarkChange::Kind::kMoved)},
              {"num_common_landmarks", difference.num_common_landmarks},
              {"median_move_m", difference.median_move_m}};
  });
}
