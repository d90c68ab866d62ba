#include <memory>
#include <string>

#include "rig_tool.h"
#include "vcharge_calibration/from_map/map_rig_calibrator.h"
#include "vcharge_core/base/error.h"
#include "vcharge_core/sparse_map/sparse_map_file.h"

namespace {

using namespace vcharge;

void calibrate(const RigToolArguments& arguments, const std::string& map_file,
               const MapRigCalibratorOptions& options, const std::string& option_text) {
  const auto rig = std::make_shared<const CameraRig>(readCameraRig(arguments.rig));
  const std::shared_ptr<const SparseMap> map = readSparseMap(map_file);
  MapRigCalibrator calibrator(map, *rig, options);
  followDrive(arguments, rig, &calibrator);
  const RigCalibration result = finishAndPrint(
      arguments, calibrator.state(),
      [&](const StageCallback& progress) { return calibrator.finish(progress); }, calibrator.images(),
      [&] { return calibrator.reportSection(); });
  auto provenance = provenanceOf(arguments, "calibrate_rig_from_map", option_text, result);
  provenance["map"] = map_file;
  provenance["map_hash"] = map->contentHash();
  writeAndTell(arguments, result, calibrator.state(), provenance);
}

}  // namespace

int main(int argc, char** argv) {
  CommandLine app(
      "Calibrates the extrinsics of a rig from a drive in a finished map of any car, with images, /odom and "
      "intrinsics, without an initial estimate, overlap, a board or loops. Drive some turns to both sides. "
      "The map "
      "defines the scale. Prints every degree of freedom with its standard deviation and a verdict: PASS, "
      "WARN "
      "with what is missing, or FAIL, which writes no file. A rig that passed is not replaced by one with a "
      "WARN, which is written beside it.");
  RigToolArguments arguments;
  addRigToolArguments(&app, &arguments);
  std::string map_file;
  app.addOption("--map", &map_file, "map of build_map or calibrate_rig (.vmap)")
      .required()
      .check(requireNotEmpty);
  return runTool(&app, argc, argv, [&](nlohmann::json* found) {
    arguments.found = found;
    runWithOptions<MapRigCalibratorOptions>(
        arguments, [&](const MapRigCalibratorOptions& options, const std::string& option_text) {
          calibrate(arguments, map_file, options, option_text);
        });
  });
}
