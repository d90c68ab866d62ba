#include <cstdio>
#include <string>

#include "vcharge_calibration/intrinsics/intrinsics_files.h"
#include "vcharge_core/base/command_line.h"
#include "vcharge_core/base/error.h"

namespace {

constexpr double kPi = 3.14159265358979323846;

struct Arguments {
  std::string input, output, camera, model;
  std::string format = "rig";
  double field_of_view_rad = kPi;
};

void convert(const Arguments& arguments, nlohmann::json* found) {
  (*found)["cameras"] = nlohmann::json::array();
  const vcharge::IntrinsicsFormat format = vcharge::intrinsicsFormat(arguments.format);
  vcharge::CameraRig rig = vcharge::readIntrinsics(arguments.input, arguments.field_of_view_rad);
  if (!arguments.camera.empty()) {
    const vcharge::RigCamera chosen = rig.cameras[rig.cameraIndex(arguments.camera)];
    rig.cameras = {chosen};
  }
  for (vcharge::RigCamera& camera : rig.cameras) {
    if (arguments.model.empty() || arguments.model == camera.model.name()) {
      continue;
    }
    const vcharge::ConvertedCamera converted =
        vcharge::convertCamera(camera.model, camera.image_size_px, camera.field_of_view_rad, arguments.model);
    std::printf("%s: %s -> %s: %.4f px RMS, at most %.4f px, over %.1f %% of the field of view\n",
                camera.name.c_str(), camera.model.name().c_str(), arguments.model.c_str(), converted.rms_px,
                converted.max_px, 100.0 * converted.covered_fraction);
    (*found)["cameras"].push_back({{"name", camera.name},
                                   {"from", camera.model.name()},
                                   {"to", arguments.model},
                                   {"rms_px", converted.rms_px},
                                   {"max_px", converted.max_px},
                                   {"covered_ratio", converted.covered_fraction}});
    camera.model = converted.model;
  }
  vcharge::writeIntrinsics(rig, format, arguments.output);
}

}  // namespace

int main(int argc, char** argv) {
  vcharge::CommandLine app(
      "Converts intrinsics between rig.yaml, Kalibr's camchain and CamOdoCal's files, and between camera "
      "models, "
      "and prints their difference in pixels. The input's format is detected from its content.");
  Arguments arguments;
  app.addOption("--input", &arguments.input, "rig.yaml, camchain.yaml or CamOdoCal's camera.yaml").required();
  app.addOption("--format", &arguments.format, "format of the output: rig, kalibr or camodocal")
      .showDefault();
  app.addOption("--model", &arguments.model, "mei, kannala_brandt or pinhole; default: unchanged");
  app.addOption("--camera", &arguments.camera, "only this camera; default: all");
  app.addOption("--field-of-view-rad", &arguments.field_of_view_rad,
                "full angle, for files that have none (Kalibr, CamOdoCal)")
      .showDefault()
      .inRange(0.1, 2.0 * kPi);
  app.addOption("--output", &arguments.output, "file to write").required().check(vcharge::requireOutput);
  app.setFooter(
      "Keys of --json: cameras that changed model (name, from, to, rms_px, max_px, covered_ratio).");
  return vcharge::runTool(&app, argc, argv, [&](nlohmann::json* found) {
    if (!arguments.model.empty()) {
      vcharge::CameraModel::parameterNames(arguments.model);
    }
    convert(arguments, found);
  });
}
