#include <algorithm>
#include <filesystem>
#include <iostream>
#include <memory>
#include <optional>
#include <set>
#include <string>
#include <vector>

#include "stage_bars.h"
#include "vcharge_core/base/command_line.h"
#include "vcharge_core/base/error.h"
#include "vcharge_core/base/options.h"
#include "vcharge_core/base/utc_time.h"
#include "vcharge_core/files/file_io.h"
#include "vcharge_core/sparse_map/sparse_map_file.h"
#include "vcharge_mapping/map_file_update.h"
#include "vcharge_mapping/session_limit.h"
#include "vcharge_mapping/session_merger.h"
#include "vcharge_reconstruction/tiled_map.h"

namespace {

using namespace vcharge;
namespace fs = std::filesystem;

struct Arguments {
  std::string map, output, options;
  std::vector<std::string> sessions;
  int max_versions = kMaxMapVersions;
  int max_sessions_per_place = 4;
  bool requires_overlap = false;
  bool show_options = false;
};

nlohmann::json toJson(const std::string& path, const MergeReport& report) {
  return {{"session", path},
          {"joined", report.joined},
          {"remark", report.remark},
          {"num_accepted_loops", report.num_accepted_loops},
          {"num_undecided_loops", report.num_undecided_loops},
          {"num_rejected_loops", report.num_rejected_loops},
          {"common_ratio", report.common_ratio},
          {"chance_ratio", report.chance_ratio},
          {"rms_px", report.rms_px}};
}

void print(const std::string& path, const MergeReport& report) {
  std::cout << path << ": " << (report.joined ? "joined" : "kept apart: " + report.remark)
            << "; loops: " << report.num_accepted_loops << " accepted, " << report.num_undecided_loops
            << " undecided, " << report.num_rejected_loops << " rejected";
  if (report.common_ratio > 0.0) {
    std::cout << "; " << 100.0 * report.common_ratio << " % of the landmarks in view are common (by chance "
              << 100.0 * report.chance_ratio << " %)";
  }
  if (report.joined) {
    std::cout << "; " << report.rms_px << " px RMS";
  }
  std::cout << "\n";
}

/// Copies a map file with its versions, and locks the copy.
void copyLocked(const std::string& from, const std::string& to, std::optional<MapFileLock>* lock) {
  writeFileAtomically(to, [&](const std::string& temporary) {
    std::error_code error;
    fs::copy_file(from, temporary, fs::copy_options::overwrite_existing, error);
    if (error) {
      throw InputError(to + ": cannot be written: " + error.message());
    }
    if (*lock) {
      (*lock)->moveTo(temporary);
    }
  });
  if (!*lock) {
    lock->emplace(to);
  }
}

void mergeMaps(const Arguments& arguments, const MergeOptions& options, nlohmann::json* found) {
  const bool in_place = fs::exists(arguments.output) && fs::equivalent(arguments.map, arguments.output);
  std::optional<MapFileLock> lock;
  if (fs::exists(arguments.output)) {
    lock.emplace(arguments.output);
  }
  std::shared_ptr<const SparseMap> map = readMapWithSessions(arguments.map);
  for (const std::string& path : arguments.sessions) {
    const std::shared_ptr<const SparseMap> session = readMapWithSessions(path);
    requireSameRig(*map, *session, path);
    requireNewDrive(*map, *session, path);
  }
  StageBars bars;
  (*found)["sessions"] = nlohmann::json::array();
  size_t num_removed = 0;
  for (size_t i = 0; i < arguments.sessions.size(); ++i) {
    const std::string& path = arguments.sessions[i];
    const std::shared_ptr<const SparseMap> session = readMapWithSessions(path);
    requireNewDrive(*map, *session, path);  // nor has one of the sessions before
    const MergedMap merged = mergeSession(*map, *session, options, [&](const StageProgress& progress) {
      bars.show(progress.stage, progress.number, progress.num_stages, progress.fraction);
    });
    bars.end();
    print(path, merged.report);
    (*found)["sessions"].push_back(toJson(path, merged.report));
    if (!merged.report.joined && arguments.requires_overlap) {
      throw InputError(path + ": " + merged.report.remark + ": not merged");
    }
    if (i == 0 && !in_place) {
      copyLocked(arguments.map, arguments.output, &lock);
    }
    map = limitSessionsPerPlace(merged.map, arguments.max_sessions_per_place);
    num_removed += merged.map->keyframes().size() - map->keyframes().size();
    const int64_t version =
        addMapVersion(*map,
                      {{"bag", session->sessions().front().name},
                       {"program", "merge_maps 0.1.0"},
                       {"date", utcNow()},
                       {"change", std::string(merged.report.joined ? "joined " : "added apart ") +
                                      fs::path(path).filename().string()}},
                      arguments.max_versions, &*lock, indexForTiles(*map));
    std::cout << "written: " << arguments.output << ", version " << version << "\n";
  }
  std::set<int32_t> components;
  for (const MapSession& session : map->sessions()) {
    components.insert(session.component);
  }
  found->update({{"num_sessions", map->sessions().size()},
                 {"num_components", components.size()},
                 {"num_keyframes", map->keyframes().size()},
                 {"num_removed_keyframes", num_removed},
                 {"num_landmarks", map->landmarks().size()},
                 {"content_hash", map->contentHash()}});
  std::cout << "sessions: " << map->sessions().size() << " in " << components.size()
            << " components, keyframes: " << map->keyframes().size() << " (" << num_removed
            << " removed at places of many drives)"
            << ", landmarks: " << map->landmarks().size() << "\ncontent hash: " << map->contentHash() << "\n";
}

}  // namespace

int main(int argc, char** argv) {
  CommandLine app(
      "Adds the drives of other maps to a map. A drive without common places is kept apart, beside the "
      "others.");
  Arguments arguments;
  app.addOption("--map", &arguments.map, "the map (*.vmap)").required().check(requireNotEmpty);
  app.addOption("--session", &arguments.sessions,
                "a map of another drive with the same rig; several may be given")
      .required()
      .check(requireNotEmpty);
  app.addOption("--output", &arguments.output,
                "map to write; may be the map itself: each session adds a version")
      .required()
      .check(requireOutput);
  app.addOption("--max-versions", &arguments.max_versions, "versions that the file keeps")
      .positive()
      .showDefault();
  app.addOption("--max-sessions-per-place", &arguments.max_sessions_per_place,
                "drives that the map keeps of a place: the newest, and those in the most different light")
      .positive()
      .showDefault();
  app.addFlag("--require-overlap", &arguments.requires_overlap, "refuse a drive without common places");
  app.addOption("--options", &arguments.options, "YAML with overrides of MergeOptions");
  addShowOptions(&app, &arguments.show_options);
  app.setFooter(
      "Keys of --json: sessions (session, joined, remark, num_accepted_loops, num_undecided_loops, "
      "num_rejected_loops, common_ratio, chance_ratio, rms_px), num_sessions, num_components, num_keyframes, "
      "num_removed_keyframes, num_landmarks, content_hash.");
  return runTool(&app, argc, argv, [&](nlohmann::json* found) {
    MergeOptions options;
    if (!arguments.options.empty()) {
      readFieldsFromFile(arguments.options, &options);
    }
    if (arguments.show_options) {
      std::cout << showOptions(options);
      return;
    }
    mergeMaps(arguments, options, found);
  });
}
