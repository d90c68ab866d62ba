#pragma once

#include <functional>
#include <memory>
#include <mutex>
#include <string>
#include <vector>

#include "vcharge_camera_driver/clock_map.h"
#include "vcharge_camera_driver/folder_frame_source.h"
#include "vcharge_core/camera/camera_rig.h"
#include "vcharge_core/frames/drive_source.h"

namespace vcharge {

/// Plays a recorded or simulated drive in real time, with current stamps.
class BagFrameSource : public FrameSource, private DriveConsumer {
 public:
  /// `ticks` receives the bag's wheel ticks with their new stamps.
  BagFrameSource(std::string bag, std::shared_ptr<const CameraRig> rig, std::vector<std::string> cameras,
                 double frame_rate_hz, ClockMap::Clock drive_clock,
                 std::function<void(const WheelTicks&)> ticks);

  void run(FrameSink* sink) override;
  void stop() override { pacer_.stop(); }
  std::vector<CameraStatus> status() const override;

 private:
  void addImage(size_t camera_index, Timestamp stamp, const Image& image) override;
  void addOdometry(const VehicleOdometry& /*odometry*/) override {}
  void addWheelTicks(const WheelTicks& ticks) override;
  /// Waits until the time of `stamp` and returns it on the current clock.
  Timestamp wait(Timestamp stamp);
  void end(const std::string& message);

  const std::string bag_;
  const std::shared_ptr<const CameraRig> rig_;
  const std::vector<std::string> cameras_;
  const double frame_rate_hz_;
  const ClockMap::Clock drive_clock_;
  const std::function<void(const WheelTicks&)> ticks_;
  Pacer pacer_;
  FrameSink* sink_ = nullptr;
  std::vector<size_t> index_of_rig_camera_;
  std::optional<Timestamp> first_;
  Timestamp start_, drive_start_;
  mutable std::mutex mutex_;
  std::vector<CameraStatus> status_;
};

}  // namespace vcharge
