#include <algorithm>
#include <filesystem>
#include <iostream>

#include "vcharge_camera_driver/v4l2_device.h"
#include "vcharge_core/base/command_line.h"
#include "vcharge_core/base/error.h"

namespace vcharge {
namespace {

std::vector<std::string> videoDevices() {
  std::vector<std::string> paths;
  std::error_code error;
  for (const auto& entry : std::filesystem::directory_iterator("/dev", error)) {
    if (entry.path().filename().string().rfind("video", 0) == 0) {
      paths.push_back(entry.path().string());
    }
  }
  std::sort(paths.begin(), paths.end());
  return paths;
}

void print(const V4l2Description& camera) {
  std::cout << camera.path << ": " << camera.card << " (" << camera.driver << ", " << camera.bus << ")"
            << (camera.captures ? "" : ": does not capture") << "\n";
  for (const std::string& format : camera.formats) {
    std::cout << "  format  " << format << "\n";
  }
  for (const V4l2Control& control : camera.controls) {
    std::cout << "  control " << control.name << "=" << control.value << " [" << control.minimum << ", "
              << control.maximum << "], default " << control.default_value << "\n";
  }
}

nlohmann::json toJson(const V4l2Description& camera) {
  nlohmann::json controls = nlohmann::json::object();
  for (const V4l2Control& control : camera.controls) {
    controls[control.name] = {{"value", control.value},
                              {"minimum", control.minimum},
                              {"maximum", control.maximum},
                              {"default", control.default_value}};
  }
  return {{"path", camera.path}, {"card", camera.card},         {"driver", camera.driver},
          {"bus", camera.bus},   {"captures", camera.captures}, {"formats", camera.formats},
          {"controls", controls}};
}

}  // namespace
}  // namespace vcharge

int main(int argc, char** argv) {
  vcharge::CommandLine app(
      "Lists V4L2 devices with their formats ('*': not supported by the driver) and controls.");
  std::vector<std::string> devices;
  app.addOption("devices", &devices, "device nodes; default: all of /dev/video*");
  app.setFooter("Keys of --json: devices (path, card, driver, bus, captures, formats, controls by name).");
  return vcharge::runTool(&app, argc, argv, [&](nlohmann::json* found) {
    const std::vector<std::string> paths = devices.empty() ? vcharge::videoDevices() : devices;
    if (paths.empty()) {
      throw vcharge::InputError("/dev/video*: there is no video device");
    }
    for (const std::string& path : paths) {
      const vcharge::V4l2Description camera = vcharge::describeV4l2Device(path);
      vcharge::print(camera);
      (*found)["devices"].push_back(vcharge::toJson(camera));
    }
  });
}
