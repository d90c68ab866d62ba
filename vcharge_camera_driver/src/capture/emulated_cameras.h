#pragma once

#include <gtest/gtest.h>
#include <unistd.h>

#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <stdexcept>
#include <string>

/// CPU time of the emulated hardware's thread in this process.
extern "C" double vchargeEmulatorCpuSeconds();

namespace vcharge {

/// A folder whose files represent the device nodes of emulated cameras (emulator/v4l2_emulator.cpp).
class EmulatedCameras {
 public:
  EmulatedCameras() {
    std::string name = (std::filesystem::temp_directory_path() / "vcharge_cameras_XXXXXX").string();
    if (mkdtemp(name.data()) == nullptr) {
      throw std::runtime_error("no temporary folder");
    }
    folder_ = name;
    setenv("VCHARGE_EMULATED_CAMERAS", folder_.c_str(), 1);
  }
  ~EmulatedCameras() {
    unsetenv("VCHARGE_EMULATED_CAMERAS");
    std::filesystem::remove_all(folder_);
  }
  EmulatedCameras(const EmulatedCameras&) = delete;
  EmulatedCameras& operator=(const EmulatedCameras&) = delete;

  std::string path(int number) const { return (folder_ / ("video" + std::to_string(number))).string(); }
  /// `config`: lines key=value, see CameraConfig.
  std::string plug(int number, const std::string& config) const {
    const std::string temporary = (folder_ / "new").string();
    std::ofstream(temporary) << config;
    std::filesystem::rename(temporary, path(number));  // so that the file appears complete
    return path(number);
  }
  void unplug(int number) const { std::filesystem::remove(path(number)); }

 private:
  std::filesystem::path folder_;
};

/// Number of the trigger pulse that the emulator encoded in a frame's first pixels.
template <class Mat>
uint64_t pulseIn(const Mat& gray) {
  uint64_t pulse = 0;
  for (int bit = 0; bit < 32; ++bit) {
    pulse |= static_cast<uint64_t>(gray.template at<unsigned char>(0, bit) > 127) << bit;
  }
  return pulse;
}

}  // namespace vcharge
