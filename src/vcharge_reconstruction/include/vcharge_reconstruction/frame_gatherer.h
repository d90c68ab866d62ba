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
#include "vcharge_reconstruction/reconstruction_report.h"

namespace vcharge {

/// Assembles frames, the images of one stamp with the odometer's pose at that stamp, in order, and counts
/// missing, late and skipped ones in a report. After a reset of the odometer its poses continue the earlier
/// ones.
class FrameGatherer : public DriveConsumer {
 public:
  /// Images in the rig's order; empty where a camera sent none.
  using FrameCallback =
      std::function<void(Timestamp, const std::vector<Image>&, const RigidTransform& odom_from_vehicle)>;

  /// The report must outlive this object. `max_speed_m_per_s`: faster odometry was reset.
  FrameGatherer(std::shared_ptr<const CameraRig> rig, double max_speed_m_per_s, ReconstructionReport* report,
                FrameCallback on_frame);

  void addImage(size_t camera_index, Timestamp stamp, const Image& image) override;
  void addOdometry(const VehicleOdometry& odometry) override;
  /// Hands out the frames that still wait.
  void finish() { processFrames(true); }
  /// Records that a frame was not used, or not completely.
  void noteSkipped(Timestamp stamp, const std::string& reason);

 private:
  struct PendingFrame {
    std::vector<Image> images;
    size_t num_present = 0;
  };
  /// The last entry of the report for a reason, and the number of its last frame.
  struct LastSkipped {
    size_t entry = 0;
    int64_t frame = 0;
  };
  void processFrames(bool all);
  std::string missingCameras(const PendingFrame& frame);

  const std::shared_ptr<const CameraRig> rig_;
  const double max_speed_m_per_s_;
  ReconstructionReport* const report_;
  const FrameCallback on_frame_;
  OdometryBuffer odometry_;
  RigidTransform corrected_from_raw_odom_;
  std::optional<VehicleOdometry> last_raw_odometry_;
  std::map<Timestamp, PendingFrame> pending_;
  std::optional<Timestamp> last_stamp_;              // of the last frame that was handed out
  std::map<std::string, LastSkipped> last_skipped_;  // by reason
};

}  // namespace vcharge
