#pragma once

#include <gtest/gtest.h>
#include <stdlib.h>

#include <filesystem>
#include <functional>
#include <string>
#include <vector>

#include <gmock/gmock.h>

#include "vcharge_core/camera_rig.h"
#include "vcharge_core/error.h"
#include "vcharge_core/timestamp.h"

namespace vcharge::testing {

/// A folder of the test's own, removed with it.
class ScratchFolder {
 public:
  ScratchFolder() {
    std::string pattern = (std::filesystem::temp_directory_path() / "vcharge_ros_XXXXXX").string();
    path_ = mkdtemp(pattern.data());
  }
  ~ScratchFolder() { std::filesystem::remove_all(path_); }
  ScratchFolder(const ScratchFolder&) = delete;
  ScratchFolder& operator=(const ScratchFolder&) = delete;

  std::string operator/(const std::string& name) const { return path_ + "/" + name; }
  const std::string& path() const { return path_; }

 private:
  std::string path_;
};

/// A fisheye camera much like those of the V-Charge car, scaled to small images.
inline CameraModel makeFisheye(cv::Size size) {
  const double focal = 0.7 * size.width;
  return MeiCamera(1.15, focal, focal, 0.5 * (size.width - 1), 0.5 * (size.height - 1));
}

/// Two cameras with extrinsics.
inline CameraRig makeRig(cv::Size size = cv::Size(32, 20)) {
  CameraRig rig;
  for (const std::string name : {"front", "left"}) {
    RigCamera camera{name, "camera_" + name + "_optical", size, makeFisheye(size)};
    camera.field_of_view_rad = 3.2;
    camera.vehicle_from_camera = RigidTransform::planar(3.0, name == "left" ? 1.0 : 0.0, 0.3);
    rig.cameras.push_back(camera);
  }
  return rig;
}

inline Timestamp milliseconds(int64_t value) {
  constexpr int64_t kDriveStart_ns = 1342626147000000000;
  return Timestamp::fromNanoseconds(kDriveStart_ns + value * 1000000);
}

/// Expects an InputError whose text holds all of `parts`.
inline void expectInputError(const std::function<void()>& action, const std::vector<std::string>& parts) {
  try {
    action();
    FAIL() << "expected an InputError";
  } catch (const InputError& error) {
    for (const std::string& part : parts) {
      EXPECT_THAT(error.what(), ::testing::HasSubstr(part));
    }
  }
}

}  // namespace vcharge::testing
