#include <cmath>
#include <cstdio>
#include <string>

#include "vcharge_calibration/report/rig_comparison.h"
#include "vcharge_core/base/command_line.h"
#include "vcharge_core/camera/camera_rig.h"

namespace {

constexpr double kDegrees = 57.29577951308232;

void print(const vcharge::RigComparison& comparison) {
  const char* const names[] = {"forwards", "sideways", "height", "roll", "pitch", "yaw"};
  for (const vcharge::CameraDifference& camera : comparison.cameras) {
    std::printf("%s: ", camera.name.c_str());
    if (camera.has_sigma) {
      std::printf("%s (chi-square %.1f of 6 degrees of freedom)\n",
                  camera.is_significant ? "MOVED" : "no significant difference", camera.chi_square);
    } else {
      std::printf("neither rig has covariances\n");
    }
    for (int i = 0; i < 6; ++i) {
      const double unit = i < 3 ? 100.0 : kDegrees;
      std::printf("  %-9s %8.3f %s", names[i], unit * camera.difference[i], i < 3 ? "cm     " : "degrees");
      if (camera.has_sigma) {
        std::printf("  +- %.3f  %5.1f standard deviations", unit * camera.sigma[i],
                    std::abs(camera.difference[i]) / camera.sigma[i]);
      }
      std::printf("\n");
    }
  }
  for (const std::string& name : comparison.only_first) {
    std::printf("%s: only in the first\n", name.c_str());
  }
  for (const std::string& name : comparison.only_second) {
    std::printf("%s: only in the second\n", name.c_str());
  }
}

nlohmann::json toJson(const vcharge::RigComparison& comparison) {
  nlohmann::json cameras = nlohmann::json::array();
  for (const vcharge::CameraDifference& camera : comparison.cameras) {
    nlohmann::json entry = {{"name", camera.name}};
    for (int i = 0; i < 6; ++i) {
      entry["difference"].push_back(camera.difference[i]);
    }
    if (camera.has_sigma) {
      entry["is_significant"] = camera.is_significant;
      entry["chi_square"] = camera.chi_square;
    }
    cameras.push_back(entry);
  }
  return {
      {"cameras", cameras}, {"only_first", comparison.only_first}, {"only_second", comparison.only_second}};
}

}  // namespace

int main(int argc, char** argv) {
  vcharge::CommandLine app(
      "Compares the extrinsics of two rigs camera by camera (axes of the vehicle), the second relative to "
      "the "
      "first, and tells which differences exceed their standard deviations.");
  std::string first, second;
  app.addOption("first", &first, "rig.yaml").required();
  app.addOption("second", &second, "rig.yaml").required();
  app.setFooter(
      "Keys of --json: cameras (name, difference of translation (m) and rotation (rad), and where "
      "covariances "
      "are known is_significant and chi_square), only_first, only_second.");
  return vcharge::runTool(&app, argc, argv, [&](nlohmann::json* found) {
    const vcharge::RigComparison comparison =
        vcharge::compareRigs(vcharge::readCameraRig(first), vcharge::readCameraRig(second));
    *found = toJson(comparison);
    print(comparison);
  });
}
