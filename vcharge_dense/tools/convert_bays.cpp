#include <cstdio>
#include <string>
#include <vector>

#include "vcharge_core/base/command_line.h"
#include "vcharge_core/base/error.h"
#include "vcharge_core/dense_maps/parking_bay_file.h"
#include "vcharge_dense/bay_lanelets.h"

namespace {

using namespace vcharge;

bool isLaneletMap(const std::string& path) {
  const std::string ending = ".osm";
  return path.size() > ending.size() && path.compare(path.size() - ending.size(), ending.size(), ending) == 0;
}

}  // namespace

int main(int argc, char** argv) {
  CommandLine app("Converts parking bays from YAML to a map of Lanelet2 (*.osm), or back.");
  std::string input, output;
  std::vector<double> datum;
  app.addOption("--input", &input,
                "bays of map_bays (YAML), or a map of Lanelet2 with areas for parking (*.osm)")
      .required();
  app.addOption("--output", &output, "*.osm or YAML to write").required().check(requireOutput);
  app.addOption("--datum", &datum,
                "latitude and longitude of the origin of the map in degrees; its x axis points east")
      .required()
      .expected(2);
  app.setFooter("Keys of --json: num_bays.");
  return runTool(&app, argc, argv, [&](nlohmann::json* found) {
    if (isLaneletMap(input) == isLaneletMap(output)) {
      throw InputError(output + ": expected " + (isLaneletMap(input) ? "YAML" : "a name that ends in .osm") +
                       ", as " + input + " is of the other sort");
    }
    const MapDatum at{datum[0], datum[1]};
    const ParkingBays bays = isLaneletMap(input) ? readBayLanelets(input, at) : readParkingBays(input);
    if (isLaneletMap(output)) {
      writeBayLanelets(bays, at, output);
    } else {
      writeParkingBays(bays, output);
    }
    *found = {{"num_bays", bays.bays.size()}};
    std::printf("bays: %zu\n", bays.bays.size());
  });
}
