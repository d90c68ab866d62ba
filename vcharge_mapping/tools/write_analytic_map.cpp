// Writes the map of vcharge_core/sparse_map/analytic_map.h, for tests of tools that read maps.
#include "vcharge_core/base/command_line.h"
#include "vcharge_core/sparse_map/analytic_map.h"
#include "vcharge_core/sparse_map/sparse_map_file.h"

int main(int argc, char** argv) {
  vcharge::CommandLine app("Writes a small map with exact observations, for tests.");
  std::string path;
  vcharge::AnalyticMapOptions options;
  app.addOption("--output", &path, "the map (*.vmap)").required().check(vcharge::requireOutput);
  app.addOption("--keyframes", &options.num_keyframes);
  app.addOption("--landmarks", &options.num_landmarks);
  app.addOption("--descriptor-bytes", &options.descriptor_size);
  return vcharge::runTool(&app, argc, argv, [&] {
    vcharge::writeSparseMap(vcharge::SparseMap(vcharge::makeAnalyticMap(options)),
                            {{"bag", "analytic.bag"}, {"options", "a: 1\nb: 2\n"}}, path);
  });
}
