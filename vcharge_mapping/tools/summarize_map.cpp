#include <cstdint>
#include <filesystem>
#include <iostream>
#include <memory>
#include <sstream>
#include <string>

#include "vcharge_core/base/command_line.h"
#include "vcharge_core/base/options.h"
#include "vcharge_core/base/utc_time.h"
#include "vcharge_core/sparse_map/sparse_map_file.h"
#include "vcharge_mapping/map_description.h"
#include "vcharge_mapping/map_summary.h"
#include "vcharge_reconstruction/map_localizer.h"
#include "vcharge_reconstruction/tiled_map.h"

namespace {

using namespace vcharge;
namespace fs = std::filesystem;

struct Arguments {
  std::string map, output, options;
  bool show_options = false;
};

/// What keeps the summary from being used; empty if nothing does.
std::string remarkOn(const SummaryReport& report, int num_cameras) {
  const int num_needed = MapLocalizerOptions().minInliersWithoutPrior(num_cameras);
  if (report.median_num_found >= num_needed) {
    return "";
  }
  std::ostringstream text;
  text << "localization may start late, or not at all: it needs to find " << num_needed << " landmarks with "
       << num_cameras << " cameras, and " << report.median_num_found << " are expected ("
       << report.median_num_found_before << " with all): keep more, or update the map by another drive";
  return text.str();
}

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
  const std::string remark = remarkOn(report, static_cast<int>(map->rig().cameras.size()));
  const std::string verdict = remark.empty() ? "GOOD" : "CHECK";
  std::cout << "landmarks: " << report.num_landmarks << " of " << report.num_landmarks_before << " ("
            << 100.0 * ratio
            << " %)\ndeviation of a pose over that with all landmarks: " << report.median_sigma_factor
            << " (median), " << report.worst_sigma_factor << " (worst), " << report.mean_sigma_factor
            << " (mean; with any choice of as many at least " << report.least_sigma_factor
            << ")\nlandmarks that a frame of another drive is expected to find: " << report.median_num_found
            << " (median), with all landmarks " << report.median_num_found_before
            << "\nfile: " << kilobytes_per_100_m << " kB per 100 m of drive\nverdict: " << verdict
            << (remark.empty() ? "" : "\n  " + remark) << "\ncontent hash: " << summary.map->contentHash()
            << "\n";
  *found = {{"num_landmarks", report.num_landmarks},
            {"num_landmarks_before", report.num_landmarks_before},
            {"median_sigma_factor", report.median_sigma_factor},
            {"worst_sigma_factor", report.worst_sigma_factor},
            {"mean_sigma_factor", report.mean_sigma_factor},
            {"least_sigma_factor", report.least_sigma_factor},
            {"median_num_found", report.median_num_found},
            {"median_num_found_before", report.median_num_found_before},
            {"kilobytes_per_100_m", kilobytes_per_100_m},
            {"verdict", verdict},
            {"remarks", remark.empty() ? nlohmann::json::array() : nlohmann::json::array({remark})},
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
      "mean_sigma_factor, least_sigma_factor (of any choice of as many landmarks), "
      "median_num_found (landmarks that a frame of another drive is expected to find), "
      "median_num_found_before "
      "(with all landmarks), kilobytes_per_100_m, verdict (GOOD, CHECK), remarks, content_hash.");
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
