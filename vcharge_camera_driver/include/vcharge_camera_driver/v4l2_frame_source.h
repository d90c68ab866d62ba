#pragma once

#include <memory>
#include <mutex>

#include "vcharge_camera_driver/clock_map.h"
#include "vcharge_camera_driver/file_descriptor.h"
#include "vcharge_camera_driver/frame_source.h"
#include "vcharge_camera_driver/v4l2_device.h"

namespace vcharge {

struct V4l2FrameSourceOptions {
  VCHARGE_BEGIN_OPTIONS(V4l2FrameSourceOptions);
  VCHARGE_OPTION_GROUP(V4l2Options, capture, {}, "Configuration of every camera.");
  VCHARGE_OPTION(double, timeout_s, 1.0, above(0.0).upTo(3600.0),
                 "Time without a frame after which a camera is reopened.");
  VCHARGE_OPTION(double, reconnect_s, 0.5, above(0.0).upTo(3600.0),
                 "Time between attempts to open a camera.");
  VCHARGE_END_OPTIONS();

  std::vector<double> readouts_s;  ///< readout time of each camera, set from the rig; empty: global shutters
};

/// Delivers frames of several V4L2 cameras in the thread that calls run(), which sleeps in poll() until a
/// frame, a deadline or stop(). A camera that cannot be opened, fails or is unplugged is reported in its
/// status and retried periodically, without affecting the others. Each frame is converted once, from the
/// kernel's buffer to the sink's memory. Its stamp is the middle of the exposure of its middle line, as far
/// as the camera tells its exposure.
class V4l2FrameSource : public FrameSource {
 public:
  /// `devices`: one path per camera.
  V4l2FrameSource(std::vector<std::string> devices, const V4l2FrameSourceOptions& options,
                  ClockMap::Clock drive_clock);
  ~V4l2FrameSource() override;

  void run(FrameSink* sink) override;
  void stop() override;
  std::vector<CameraStatus> status() const override;

 private:
  struct Camera;

  void connect(Camera* camera, Timestamp now);
  void disconnect(Camera* camera, const std::string& reason, Timestamp now);
  void readFrames(size_t index, FrameSink* sink, Timestamp now);
  bool take(size_t index, const V4l2Frame& frame, FrameSink* sink);
  /// Asks the cameras for their exposure, which they may control themselves.
  void updateExposures();
  /// Opens due cameras and closes silent ones; returns the time until the next deadline.
  Duration maintain(Timestamp now);

  const V4l2FrameSourceOptions options_;
  ClockMap clock_;
  FileDescriptor wake_;
  mutable std::mutex mutex_;  // protects the cameras' status
  std::vector<std::unique_ptr<Camera>> cameras_;
};

}  // namespace vcharge
