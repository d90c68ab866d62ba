#pragma once

#include <memory>
#include <optional>
#include <string>
#include <vector>

#include <opencv2/core.hpp>

#include "vcharge_core/camera/camera_rig.h"
#include "vcharge_core/motion/tracked_object.h"
#include "vcharge_core/motion/vehicle_odometry.h"

namespace vcharge {

/// Writes a recorded drive on the suite's standard topics: images and camera_info of every camera, /odom,
/// /wheel_ticks and, for simulated drives, /ground_truth and /ground_truth/objects. close() gives the bag its
/// final name. `received` is the recording time of a message, by default its stamp.
class DriveBagWriter {
 public:
  /// InputError when the folder cannot be written.
  DriveBagWriter(const std::string& path, const CameraRig& rig);
  /// Removes the unfinished file unless close() was called.
  ~DriveBagWriter();

  /// Writes an image; `pixels` is CV_8UC1 of the rig's size.
  void writeImage(size_t camera_index, Timestamp stamp, const cv::Mat& pixels,
                  std::optional<Timestamp> received = std::nullopt);
  void writeOdometry(const VehicleOdometry& odometry, std::optional<Timestamp> received = std::nullopt);
  void writeWheelTicks(const WheelTicks& ticks, std::optional<Timestamp> received = std::nullopt);
  /// Writes the exact transform from `base_link` to `world`.
  void writeGroundTruth(const VehicleOdometry& truth);
  /// Writes the true objects in the frame `world`.
  void writeTrueObjects(Timestamp stamp, const std::vector<TrackedObject>& objects);
  void close();

 private:
  struct Implementation;
  std::unique_ptr<Implementation> implementation_;
};

}  // namespace vcharge
