#include <memory>
#include <string>

#include "rig_tool.h"
#include "vcharge_calibration/rig/rig_calibrator.h"
#include "vcharge_core/base/error.h"
#include "vcharge_core/sparse_map/sparse_map_file.h"
#include "vcharge_reconstruction/tiled_map.h"

namespace {

using namespace vcharge;

void calibrate(const RigToolArguments& arguments, const std::string& map_file,
               const RigCalibratorOptions& options, const std::string& option_text) {
  const auto rig = std::make_shared<const CameraRig>(readCameraRig(arguments.rig));
  RigCalibrator calibrator(rig, options);
  followDrive(arguments, rig, &calibrator);
  const RigCalibration result = finishAndPrint(
      arguments, calibrator.state(),
      [&](const StageCallback& progress) { return calibrator.finish(progress); }, calibrator.images());
  const auto provenance = provenanceOf(arguments, "calibrate_rig", option_text, result);
  if (!map_file.empty()) {
    const std::shared_ptr<const SparseMap> map = calibrator.map();
    writeSparseMap(*map, provenance, map_file, indexForTiles(*map));
  }
  writeAndTell(arguments, result, calibrator.state(), provenance);
}

}  // namespace

int main(int argc, char** argv) {
  CommandLine app(
      "Calibrates the extrinsics of a rig from a drive with images, /odom and intrinsics, without an "
      "initial estimate, overlap or a board. Drive 100 m or more with turns to both sides and revisit "
      "places, best a "
      "figure of eight. Prints every degree of freedom with its standard deviation and a verdict: PASS, WARN "
      "with what is missing, or FAIL, which writes no file. A rig that passed is not replaced by one with a "
      "WARN, which is written beside it.");
  RigToolArguments arguments;
  addRigToolArguments(&app, &arguments);
  std::string map_file;
  app.addOption("--map", &map_file, "sparse map to write (.vmap)").check(requireOutput);
  return runTool(&app, argc, argv, [&](nlohmann::json* found) {
    arguments.found = found;
    runWithOptions<RigCalibratorOptions>(
        arguments, [&](const RigCalibratorOptions& options, const std::string& option_text) {
          calibrate(arguments, map_file, options, option_text);
        });
  });
}
