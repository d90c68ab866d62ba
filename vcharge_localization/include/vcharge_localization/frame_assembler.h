#pragma once

#include <cstdint>
#include <functional>
#include <map>
#include <memory>
#include <optional>
#include <vector>

#include "vcharge_core/base/options.h"
#include "vcharge_core/base/timestamp.h"
#include "vcharge_core/camera/camera_rig.h"
#include "vcharge_core/frames/drive_source.h"

namespace vcharge {

struct FrameAssemblerOptions {
  int silent_after_frames = 3;  ///< a camera that missed this many is not waited for until it sends again
  double max_odometry_wait_s = 0.3;  ///< in the drive's time; then a frame goes without
  double max_speed_m_per_s = 25.0;   ///< faster odometry is a reset of the counters
  OdometryBufferOptions odometry;

  template <class Visitor>
  void visitFields(Visitor&& visit) {
    visit("silent_after_frames", silent_after_frames);
    visit("max_odometry_wait_s", max_odometry_wait_s);
    visit("max_speed_m_per_s", max_speed_m_per_s);
    visit("odometry", odometry);
  }
  void validate() const;  ///< throws std::invalid_argument naming the field
};

/// The images of one instant, and where the odometer saw the vehicle then.
struct LocalizationFrame {
  Timestamp stamp;
  std::vector<Image> images;  ///< in the rig's order; empty where a camera sent none
  std::optional<RigidTransform> odom_from_vehicle;
  int64_t num_resets = 0;  ///< of the odometer before this frame
};

struct FrameAssemblerCounts {
  int64_t frames = 0;
  int64_t incomplete_frames = 0;
  int64_t frames_without_odometry = 0;
  int64_t late_images = 0;  ///< of a frame that was handed out, or older
  int64_t odometry_resets = 0;
};

/// Puts a drive's images together to frames, in order of stamps: a frame is handed out once all cameras have
/// sent that are not silent, and odometry reaches its stamp. Stamps that jump back by more than a second
/// start over. Not thread safe.
class FrameAssembler : public DriveConsumer {
 public:
  using FrameCallback = std::function<void(LocalizationFrame)>;

  FrameAssembler(size_t num_cameras, const FrameAssemblerOptions& options, FrameCallback on_frame);

  void addImage(size_t camera_index, Timestamp stamp, const Image& image) override;
  void addOdometry(const VehicleOdometry& odometry) override;
  /// Hands out what waits, at the end of a drive.
  void finish();

  const FrameAssemblerCounts& counts() const { return counts_; }
  /// A camera that sent nothing for the last frames.
  bool isSilent(size_t camera_index) const;

 private:
  struct Pending {
    std::vector<Image> images;
    size_t num_present = 0;
  };
  void handOut(bool all);
  bool hasAllImages(Timestamp stamp, const Pending& pending) const;
  bool hasOdometry(Timestamp stamp) const;
  void emit(Timestamp stamp, Pending pending);

  const size_t num_cameras_;
  const FrameAssemblerOptions options_;
  const FrameCallback on_frame_;
  OdometryBuffer odometry_;
  std::optional<VehicleOdometry> last_odometry_;
  std::optional<Timestamp> newest_image_, last_frame_;
  std::vector<int> missed_;  // frames in a row, by camera
  std::map<Timestamp, Pending> pending_;
  FrameAssemblerCounts counts_;
};

}  // namespace vcharge
