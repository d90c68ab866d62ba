#pragma once

#include <gtest/gtest.h>
#include <stdlib.h>

#include <filesystem>
#include <functional>
#include <string>
#include <vector>

#include <gmock/gmock.h>

#include "vcharge_core/base/error.h"
#include "vcharge_core/base/timestamp.h"
#include "vcharge_core/camera/camera_rig.h"
#include "vcharge_core/frames/drive_source.h"

namespace vcharge::testing {

/// A temporary folder that the destructor removes.
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

/// Size of the images of the tests' drives.
inline const cv::Size kSize(32, 20);

inline cv::Mat makePixels(int camera, int frame) {
  cv::Mat pixels(kSize, CV_8UC1);
  for (int i = 0; i < kSize.area(); ++i) {
    pixels.data[i] = static_cast<uint8_t>(7 * i + 50 * camera + 3 * frame);
  }
  return pixels;
}

inline VehicleOdometry makeOdometry(int64_t time_ms) {
  return {milliseconds(time_ms), RigidTransform::planar(0.001 * static_cast<double>(time_ms), 0.0, 0.0), 1.0,
          0.0};
}

/// Records the delivered items: "o<ms>" (odometry), "t<ms>" (wheel ticks), "<camera>:<ms>" (image).
class Notes : public DriveConsumer {
 public:
  void addImage(size_t camera_index, Timestamp stamp, const Image& image) override {
    note(std::to_string(camera_index) + ":", stamp);
    images.push_back(image);
  }
  void addOdometry(const VehicleOdometry& odometry) override { note("o", odometry.stamp); }
  void addWheelTicks(const WheelTicks& ticks) override { note("t", ticks.stamp); }

  std::vector<std::string> order;
  std::vector<Timestamp> stamps;
  std::vector<Image> images;

 private:
  void note(const std::string& what, Timestamp stamp) {
    order.push_back(what + std::to_string((stamp - milliseconds(0)).count() / 1000000));
    stamps.push_back(stamp);
  }
};

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
