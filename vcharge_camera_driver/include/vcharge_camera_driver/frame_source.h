#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "vcharge_core/frames/image.h"

namespace vcharge {

/// One image of one camera.
struct CapturedFrame {
  size_t camera_index = 0;
  uint32_t sequence = 0;  ///< counts the camera's frames, including lost ones
  Timestamp stamp;        ///< stamp of the camera, converted to the drive's clock
  Image image;
};

/// Receives frames. Called only within the run() of a FrameSource, never concurrently.
class FrameSink {
 public:
  virtual ~FrameSink() = default;
  /// Memory for a CV_8UC1 image, to be filled and passed to add(), or dropped.
  virtual Image acquire(cv::Size size_px) = 0;
  virtual void add(const CapturedFrame& frame) = 0;
  /// Called after each wait. Returns the maximum time until the next call.
  virtual Duration idle() = 0;
};

/// State of one camera for /diagnostics.
struct CameraStatus {
  std::string device;
  bool streaming = false;
  std::string message;   ///< "streaming GREY", or the problem
  uint64_t frames = 0;   ///< frames received
  uint64_t lost = 0;     ///< frames lost, according to the sequence numbers of received frames
  uint64_t damaged = 0;  ///< frames flagged as damaged, too short, or not decodable
  uint64_t timeouts = 0;
  uint64_t connections = 0;  ///< number of times the device was opened
  std::optional<double> exposure_s;
  /// Frames per second of the kernel's clock since the frames' numbers began, from numbers and stamps.
  std::optional<double> rate_hz;
};

/// A source of frames: cameras, or the images of a recorded drive.
class FrameSource {
 public:
  virtual ~FrameSource() = default;
  /// Delivers frames until stop() or the end of the images. May be called only once.
  virtual void run(FrameSink* sink) = 0;
  /// Ends run() soon, even while it waits; thread safe.
  virtual void stop() = 0;
  /// Status of each camera; thread safe.
  virtual std::vector<CameraStatus> status() const = 0;
};

}  // namespace vcharge
