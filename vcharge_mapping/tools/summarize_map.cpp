#include <cstdint>
#include <filesystem>
#include <iostream>
#include <memory>
#include <string>

#include "vcharge_core/base/command_line.h"
#include "vcharge_core/base/options.h"
#include "vcharge_core/base/utc_time.h"
#include "vcharge_core/sparse_map/sparse_map_file.h"
#include "vcharge_mapping/map_description.h"
#include "vcharge_mapping/map_summary.h"
#include "vcharge_reconstruction/tiled_map.h"

namespace {

using namespace vcharge;
namespace fs = std::filesystem;

struct Arguments {
  std::string map, output, options;
  bool show_options = false;
};

void summarize(const Arguments& arguments, const SummaryOptions& options, nlohmann::json* found) {
  MapProvenance provenance;
  const std::shared_ptr<const SparseMap> map = readSparseMap(arguments.map, &provenance);
  const SummaryMap summary = summarizeMap(*map, options);
  provenance["program"] = "summarize_map 0.1.0";
  provenance["date"] = utcNow();
  provenance["change"] = "summary of " + fs::path(arguments.map).filename().string();
  writeSparseMap(*summary.map, provenance, arguments.output, indexForTiles(*summary.map));
  const double kilobytes_per_100_m =
      static_cast<double>(fs::file_size(arguments.output)) / 1e3 / (lengthOf_m(*map) / 100.0);
  const SummaryReport& report = summary.report;
  const double ratio =
      static_cast<double>(report.num_landmarks) / static_cast<double>(report.num_landmarks_before);
  std::cout << "landmarks: " << report.num_landmarks << " of " << report.num_landmarks_before << " ("
            << 100.0 * ratio
            << " %)\ndeviation of a pose over that with all landmarks: " << report.median_sigma_factor
            << " (median), " << report.worst_sigma_factor << " (worst)\nfile: " << kilobytes_per_100_m
            << " kB per 100 m of drive\ncontent hash: " << summary.map->contentHash() << "\n";
  *found = {{"num_landmarks", report.num_landmarks},
            {"num_landmarks_before", report.num_landmarks_before},
            {"median_sigma_factor", report.median_sigma_factor},
            {"worst_sigma_factor", report.worst_sigma_factor},
            {"kilobytes_per_100_m", kilobytes_per_100_m},
            {"content_hash", summary.map->contentHash()}};
}

}  // namespace

int main(int argc, char** argv) {
  CommandLine app("Writes a map with as few landmarks as localization needs.");
  Arguments arguments;
  app.addOption("--map", &arguments.map, "the map (*.vmap)").required().check(requireNotEmpty);
  app.addOption("--output", &arguments.output, "map to write (*.vmap)").required().check(requireOutput);
  app.addOption("--options", &arguments.options, "YAML with overrides of SummaryOptions");
  addShowOptions(&app, &arguments.show_options);
  app.setFooter(
      "Keys of --json: num_landmarks, num_landmarks_before, median_sigma_factor, worst_sigma_factor, "
      "kilobytes_per_100_m, content_hash.");
  return runTool(&app, argc, argv, [&](nlohmann::json* found) {
    SummaryOptions options;
    if (!arguments.options.empty()) {
      readFieldsFromFile(arguments.options, &options);
    }
    if (arguments.show_options) {
      std::cout << showOptions(options);
      return;
    }
    summarize(arguments, options, found);
  });
}
