#include "camera_config.h"

#include <fstream>
#include <sstream>

namespace vcharge::emulator {

CameraConfig readCameraConfig(const std::string& path) {
  CameraConfig config;
  std::ifstream file(path);
  for (std::string line; std::getline(file, line);) {
    const size_t equals = line.find('=');
    const std::string key = line.substr(0, equals);
    const std::string value = equals == std::string::npos ? "" : line.substr(equals + 1);
    const auto number = [&] { return std::stoll(value); };
    if (key == "width") config.width = static_cast<uint32_t>(number());
    if (key == "height") config.height = static_cast<uint32_t>(number());
    if (key == "rate_hz") config.rate_hz = std::stod(value);
    if (key == "capabilities") config.capabilities = value;
    if (key == "exposure_us") config.exposure_us = number();
    if (key == "readout_us") config.readout_us = number();
    if (key == "jitter_us") config.jitter_us = number();
    if (key == "drop_every") config.drop_every = static_cast<uint64_t>(number());
    if (key == "damage_every") config.damage_every = static_cast<uint64_t>(number());
    if (key == "short_every") config.short_every = static_cast<uint64_t>(number());
    if (key == "silent_after") config.silent_after = static_cast<uint64_t>(number());
    if (key == "unknown_clock") config.unknown_clock = number() != 0;
    if (key == "stamps_start") config.stamps_start = number() != 0;
    if (key == "fail") {
      const size_t colon = value.find(':');
      config.failures[value.substr(0, colon)] = std::stoi(value.substr(colon + 1));
    }
    if (key == "formats") {
      config.formats.clear();
      std::istringstream words(value);
      for (std::string word; std::getline(words, word, ',');) {
        config.formats.push_back(word);
      }
    }
  }
  return config;
}

}  // namespace vcharge::emulator
