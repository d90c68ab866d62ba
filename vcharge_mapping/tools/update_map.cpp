#include <iostream>
#include <memory>
#include <string>

#include "stage_bars.h"
#include "vcharge_core/base/command_line.h"
#include "vcharge_core/base/options.h"
#include "vcharge_mapping/map_file_update.h"

namespace {

using namespace vcharge;

struct Arguments {
  std::string map, session, options;
  int max_versions = kMaxMapVersions;
  bool show_options = false;
};

void updateMapFile(const Arguments& arguments, const UpdateOptions& options, nlohmann::json* found) {
  const std::shared_ptr<const SparseMap> session = readMapWithSessions(arguments.session);
  StageBars bars;
  const MapFileUpdate update =
      updateMapFile(arguments.map, *session, arguments.session, "update_map 0.1.0", arguments.max_versions,
                    options, [&](const StageProgress& progress) {
                      bars.show(progress.stage, progress.number, progress.num_stages, progress.fraction);
                    });
  bars.end();
  const UpdatedMap& updated = update.updated;
  const int64_t version = update.version;
  const UpdateReport& report = updated.report;
  std::cout << "loops: " << report.merge.num_accepted_loops << " accepted; "
            << 100.0 * report.merge.common_ratio << " % of the landmarks in view are common; "
            << report.merge.rms_px << " px RMS\nlandmarks: " << report.num_seen_landmarks << " seen again, "
            << report.num_missed_landmarks << " missed, " << report.num_removed_landmarks << " removed, "
            << report.num_new_landmarks
            << " new\nplaces shown by later drives: " << report.num_removed_keyframes
            << " keyframes removed, with " << report.num_forgotten_landmarks
            << " landmarks\nsessions: " << updated.map->sessions().size()
            << ", keyframes: " << updated.map->keyframes().size()
            << ", landmarks: " << updated.map->landmarks().size() << "\nwritten: " << arguments.map
            << ", version " << version << "\ncontent hash: " << updated.map->contentHash() << "\n";
  *found = {{"num_accepted_loops", report.merge.num_accepted_loops},
            {"common_ratio", report.merge.common_ratio},
            {"rms_px", report.merge.rms_px},
            {"num_seen_landmarks", report.num_seen_landmarks},
            {"num_missed_landmarks", report.num_missed_landmarks},
            {"num_removed_landmarks", report.num_removed_landmarks},
            {"num_new_landmarks", report.num_new_landmarks},
            {"num_removed_keyframes", report.num_removed_keyframes},
            {"num_forgotten_landmarks", report.num_forgotten_landmarks},
            {"num_sessions", updated.map->sessions().size()},
            {"num_keyframes", updated.map->keyframes().size()},
            {"num_landmarks", updated.map->landmarks().size()},
            {"version", version},
            {"content_hash", updated.map->contentHash()}};
}

}  // namespace

int main(int argc, char** argv) {
  CommandLine app(
      "Updates a map by a drive of another day: adds what is new, removes what several drives missed, and "
      "keeps the map's size.");
  Arguments arguments;
  app.addOption("--map", &arguments.map, "the map (*.vmap); gets a new version")
      .required()
      .check(requireOutput);
  app.addOption("--session", &arguments.session, "the map that build_map made of the drive")
      .required()
      .check(requireNotEmpty);
  app.addOption("--max-versions", &arguments.max_versions, "versions that the file keeps")
      .positive()
      .showDefault();
  app.addOption("--options", &arguments.options, "YAML with overrides of UpdateOptions");
  addShowOptions(&app, &arguments.show_options);
  app.setFooter(
      "Keys of --json: num_accepted_loops, common_ratio, rms_px, num_seen_landmarks, num_missed_landmarks, "
      "num_removed_landmarks, num_new_landmarks, num_removed_keyframes, num_forgotten_landmarks, "
      "num_sessions, num_keyframes, num_landmarks, version, content_hash.");
  return runTool(&app, argc, argv, [&](nlohmann::json* found) {
    UpdateOptions options;
    if (!arguments.options.empty()) {
      readFieldsFromFile(arguments.options, &options);
    }
    if (arguments.show_options) {
      std::cout << showOptions(options);
      return;
    }
    updateMapFile(arguments, options, found);
  });
}
