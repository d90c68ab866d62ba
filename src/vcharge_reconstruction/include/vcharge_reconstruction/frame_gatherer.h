#pragma once

#include <cstdint>
#include <functional>
#include <map>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "vcharge_core/camera/camera_rig.h"
#include "vcharge_core/frames/drive_source.h"
#include "vcharge_core/motion/vehicle_odometry.h"
#include "vcharge_reconstruction/sparse_mapper_report.h"

namespace vcharge {

/// Puts images of one stamp together with the vehicle's pose by the odometer, in order, and counts in a
/// report what was not as it should be. Odometers that start over are joined to what they counted before.
class FrameGatherer : public DriveConsumer {
 public:
  /// Images in the rig's order; empty where a camera sent none.
  using FrameCallback =
      std::function<void(Timestamp, const std::vector<Image>&, const RigidTransform& odom_from_vehicle)>;

  /// The report must outlive this object. `max_speed_m_per_s`: faster odometry is a reset of the counters.
  FrameGatherer(std::shared_ptr<const CameraRig> rig, double max_speed_m_per_s, SparseMapperReport* report,
                FrameCallback on_frame);

  void addImage(size_t camera_index, Timestamp stamp, const Image& image) override;
  void addOdometry(const VehicleOdometry& odometry) override;
  /// Hands out what waits.
  void finish() { processFrames(true); }
  /// Notes that a frame was not used, or not as it should be.
  void noteSkipped(Timestamp stamp, const std::string& reason);

  bool isIdle() const { return pending_.empty(); }
  /// As if the frames until this stamp had been handed out.
  void resumeAfter(std::optional<Timestamp> stamp) { last_stamp_ = stamp; }

 private:
  struct PendingFrame {
    std::vector<Image> images;
    size_t num_present = 0;
  };
  /// Which entry of the report a reason has last, and the number of the frame that it ends with.
  struct LastSkipped {
    size_t entry = 0;
    int64_t frame = 0;
  };
  void processFrames(bool all);
  std::string missingCameras(const PendingFrame& frame);

  const std::shared_ptr<const CameraRig> rig_;
  const double max_speed_m_per_s_;
  SparseMapperReport* const report_;
  const FrameCallback on_frame_;
  OdometryBuffer odometry_;
  RigidTransform corrected_from_raw_odom_;
  std::optional<VehicleOdometry> last_raw_odometry_;
  std::map<Timestamp, PendingFrame> pending_;
  std::optional<Timestamp> last_stamp_;              // of a frame that had its turn
  std::map<std::string, LastSkipped> last_skipped_;  // by reason
};

}  // namespace vcharge
