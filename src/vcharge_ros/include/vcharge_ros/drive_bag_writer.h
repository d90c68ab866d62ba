#pragma once

#include <memory>
#include <string>

#include <opencv2/core.hpp>

#include "vcharge_core/camera_rig.h"
#include "vcharge_core/vehicle_odometry.h"

namespace vcharge {

/// Writes a recorded drive on the suite's standard topics: images and camera_info of every camera, /odom,
/// /wheel_ticks and, for simulated drives, /ground_truth. The bag appears under its name only once close()
/// returned.
class DriveBagWriter {
 public:
  /// InputError when the folder cannot be written.
  DriveBagWriter(const std::string& path, const CameraRig& rig);
  /// Removes the unfinished file unless close() was called.
  ~DriveBagWriter();

  /// CV_8UC1 of the rig's size. Message time equals the stamp.
  void writeImage(size_t camera_index, Timestamp stamp, const cv::Mat& pixels);
  void writeOdometry(const VehicleOdometry& odometry);
  void writeWheelTicks(const WheelTicks& ticks);
  /// `world` -> `base_link`, exact.
  void writeGroundTruth(const VehicleOdometry& truth);
  void close();

 private:
  struct Implementation;
  std::unique_ptr<Implementation> implementation_;
};

}  // namespace vcharge
