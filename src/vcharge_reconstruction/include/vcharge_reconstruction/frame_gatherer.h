#pragma once

#include <cstdint>
#include <functional>
#include <map>
#include <memory>
#include <string>
#include <vector>

#include "vcharge_core/camera/camera_rig.h"
#include "vcharge_core/frames/frame_assembler.h"
#include "vcharge_reconstruction/reconstruction_report.h"

namespace vcharge {

/// Assembles the frames of a drive for mapping and calibration: waits for all images and odometry and reports
/// the frames that are skipped. Frames without odometry are not used; resets of the odometer are
/// bridged.
class FrameGatherer : public DriveConsumer {
 public:
  /// Images in the rig's order; empty where a camera sent none.
  using FrameCallback =
      std::function<void(Timestamp, const std::vector<Image>&, const RigidTransform& odom_from_vehicle)>;

  /// The report must outlive this object. Odometry faster than `max_speed_m_per_s` is an odometer reset.
  FrameGatherer(std::shared_ptr<const CameraRig> rig, double max_speed_m_per_s, ReconstructionReport* report,
                FrameCallback on_frame);

  void addImage(size_t camera_index, Timestamp stamp, const Image& image) override;
  void addOdometry(const VehicleOdometry& odometry) override;
  /// Hands out the waiting frames at the end of the drive.
  void finish() { assembler_.finish(); }
  /// Reports that a frame was not used, or not completely.
  void noteSkipped(Timestamp stamp, const std::string& reason);

 private:
  /// The report's last entry for a reason, and the number of the frame that it ends with.
  struct LastSkipped {
    size_t entry = 0;
    int64_t frame = 0;
  };
  void process(const ImageFrame& frame);
  std::string missingCameras(const ImageFrame& frame);

  const std::shared_ptr<const CameraRig> rig_;
  ReconstructionReport* const report_;
  const FrameCallback on_frame_;
  std::map<std::string, LastSkipped> last_skipped_;  // key: reason
  FrameAssembler<Image> assembler_;
};

}  // namespace vcharge
