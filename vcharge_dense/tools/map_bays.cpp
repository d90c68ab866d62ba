#include <algorithm>
#include <cstdio>
#include <string>

#include "vcharge_core/base/command_line.h"
#include "vcharge_core/base/error.h"
#include "vcharge_core/dense_maps/height_map_file.h"
#include "vcharge_core/dense_maps/parking_bay_file.h"
#include "vcharge_core/files/content_hash.h"
#include "vcharge_dense/bay_finder.h"

namespace {

using namespace vcharge;

void mapBays(const std::string& height_map, const std::string& output, nlohmann::json* found) {
  const HeightMap map = readHeightMap(height_map);
  ParkingBays bays;
  try {
    bays = findBays(map);
  } catch (const InputError& error) {
    throw InputError(height_map + ": " + error.what());
  }
  writeParkingBays(bays, output);
  const auto count = [&](BayState state) {
    return std::count_if(bays.bays.begin(), bays.bays.end(),
                         [&](const ParkingBay& bay) { return bay.state == state; });
  };
  ContentHasher hasher;
  addToHash(bays, &hasher);
  *found = {{"num_bays", bays.bays.size()},
            {"num_rows", bays.bays.empty() ? 0 : bays.bays.back().row + 1},
            {"num_free", count(BayState::kFree)},
            {"num_occupied", count(BayState::kOccupied)},
            {"num_unknown", count(BayState::kUnknown)},
            {"content_hash", hasher.hex()}};
  if (bays.bays.empty()) {
    std::printf(
        "no painted bays: no three parallel lines at equal distances of 2.1 to 3.4 m, or 4.8 to 7.5 m\n");
  } else {
    std::printf("bays: %zu in %u rows; %td free, %td occupied, %td unknown\n", bays.bays.size(),
                bays.bays.back().row + 1, count(BayState::kFree), count(BayState::kOccupied),
                count(BayState::kUnknown));
  }
  std::printf("content hash: %s\n", hasher.hex().c_str());
}

}  // namespace

int main(int argc, char** argv) {
  CommandLine app(
      "Finds painted parking bays in the gray levels of a height map, and which of them were free when it "
      "was "
      "recorded.");
  std::string height_map, output;
  app.addOption("--height-map", &height_map, "folder written by build_height_map, or its YAML").required();
  app.addOption("--output", &output, "YAML to write").required().check(requireOutput);
  app.setFooter(
      "Keys of --json: num_bays, num_rows, num_free, num_occupied, num_unknown (too little of the bay was "
      "seen), "
      "content_hash.");
  return runTool(&app, argc, argv, [&](nlohmann::json* found) { mapBays(height_map, output, found); });
}
