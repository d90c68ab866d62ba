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

}  // namespace

int main(int argc, char** argv) {
  CLI::App app(
      "Compares the extrinsics of two rigs camera by camera (axes of the vehicle), the second relative to "
      "the "
      "first, and tells which differences exceed their standard deviations.");
  std::string first, second;
  app.add_option("first", first, "rig.yaml")->required();
  app.add_option("second", second, "rig.yaml")->required();
  return vcharge::runTool(&app, argc, argv, [&] {
    print(vcharge::compareRigs(vcharge::readCameraRig(first), vcharge::readCameraRig(second)));
  });
}
