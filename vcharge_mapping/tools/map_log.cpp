#include <cstdio>
#include <memory>
#include <optional>

#include "vcharge_core/base/command_line.h"
#include "vcharge_core/base/utc_time.h"
#include "vcharge_core/sparse_map/sparse_map_file.h"
#include "vcharge_mapping/map_file_update.h"
#include "vcharge_reconstruction/tiled_map.h"

namespace {

using namespace vcharge;

std::string valueOf(const MapVersion& version, const char* key) {
  const auto found = version.provenance.find(key);
  return found == version.provenance.end() ? "-" : found->second;
}

void goBack(const std::string& path, int64_t number, int max_versions) {
  MapFileLock lock(path);
  const std::shared_ptr<const SparseMap> map = readSparseMap(path, nullptr, number);
  const int64_t added = addMapVersion(*map,
                                      {{"program", "map_log 0.1.0"},
                                       {"date", utcNow()},
                                       {"change", "back to version " + std::to_string(number)}},
                                      max_versions, &lock, indexForTiles(*map));
  std::printf("written: %s, version %lld\n", path.c_str(), static_cast<long long>(added));
}

}  // namespace

int main(int argc, char** argv) {
  CommandLine app("Lists the versions of a map, and goes back to an earlier one.");
  std::string path;
  std::optional<int64_t> back_to;
  int max_versions = kMaxMapVersions;
  app.addOption("--map", &path, "the map (*.vmap)").required().check(requireNotEmpty);
  app.addOption("--back-to", &back_to, "version whose content becomes the newest version");
  app.addOption("--max-versions", &max_versions, "versions that the file keeps").positive().showDefault();
  app.setFooter("Keys of --json: versions (number, change, bag, date, program, content_hash).");
  return runTool(&app, argc, argv, [&](nlohmann::json* found) {
    if (back_to) {
      goBack(path, *back_to, max_versions);
    }
    (*found)["versions"] = nlohmann::json::array();
    std::printf("%7s  %-20s  %-18s  %-32s  %s\n", "version", "date", "program", "content hash",
                "change, bag");
    for (const MapVersion& version : readMapVersions(path)) {
      std::printf("%7lld  %-20s  %-18s  %-32s  %s, %s\n", static_cast<long long>(version.number),
                  valueOf(version, "date").c_str(), valueOf(version, "program").c_str(),
                  version.content_hash.c_str(), valueOf(version, "change").c_str(),
                  valueOf(version, "bag").c_str());
      (*found)["versions"].push_back({{"number", version.number},
                                      {"change", valueOf(version, "change")},
                                      {"bag", valueOf(version, "bag")},
                                      {"date", valueOf(version, "date")},
                                      {"program", valueOf(version, "program")},
                                      {"content_hash", version.content_hash}});
    }
  });
}
