#include <iostream>
#include <optional>
#include <sstream>
#include <string>

#include <tbb/global_control.h>

#include "drive_recorder.h"
#include "scenario_command_line.h"
#include "vcharge_core/base/command_line.h"
#include "vcharge_core/base/error.h"
#include "vcharge_core/base/options.h"

int main(int argc, char** argv) {
  vcharge::CommandLine app(
      "Simulates a drive of a car with four fisheye cameras and writes it as a bag. Beside it are written "
      "rig_truth.yaml and the folder BAG_truth with rig.yaml and masks, trajectory.tum, height_map.tiff and "
      ".yaml, obstacles.yaml, bays.yaml, movers.yaml, faults.yaml and, depending on options and scene, "
      "board.yaml, "
      "range/CAMERA/STAMP_NS.tiff, and rig_before.yaml and rig_after.yaml of a fault that changes the rig.");
  const vcharge::ScenarioCommandLine command_line(&app);
  vcharge::RecordingOptions recording;
  bool list = false;
  bool show_options = false;
  int threads = 0;
  const vcharge::CommandLine::Option output =
      app.addOption("--output", &recording.bag, "bag to write").check(vcharge::requireOutput);
  app.addOption(
      "--images-from", &recording.images_from,
      "bag of the same drive with the same --seed and --noise off, whose images are used; those that faults "
      "change are rendered");
  app.addFlag("--truth-range", &recording.truth_range, "write the range of every pixel");
  app.addOption("--height-cell-m", &recording.height_cell_m, "cell size of the height map").showDefault();
  app.addOption("--threads", &threads, "number of threads; 0: one per core").notNegative().showDefault();
  app.addFlag("--list", &list, "print scenes, drives, rigs and faults, and exit");
  vcharge::addShowOptions(&app, &show_options);
  app.setFooter("Keys of --json: scenario (all its options).");
  return vcharge::runTool(&app, argc, argv, [&](nlohmann::json* found) {
    if (list) {
      std::cout << vcharge::describeCatalogue();
      return;
    }
    const vcharge::DriveScenario scenario = command_line.scenario();
    if (show_options) {
      std::cout << vcharge::showOptions(scenario);
      return;
    }
    vcharge::requireField(recording.height_cell_m >= 0.01 && recording.height_cell_m <= 10.0, "height_cell_m",
                          "must be in [0.01, 10]", recording.height_cell_m);
    if (!output.isGiven()) {
      throw vcharge::InputError("--output is required (see --help)");
    }
    std::optional<tbb::global_control> limit;
    if (threads > 0) {
      limit.emplace(tbb::global_control::max_allowed_parallelism, static_cast<size_t>(threads));
    }
    vcharge::recordDrive(scenario, recording);
    std::ostringstream text;
    text << vcharge::writeFields(scenario);
    (*found)["scenario"] = text.str();
  });
}
