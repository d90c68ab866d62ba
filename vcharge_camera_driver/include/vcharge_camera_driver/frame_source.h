#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "vcharge_core/frames/image.h"

namespace vcharge {

/// One image of one camera, as the camera made it.
struct CapturedFrame {
  size_t camera_index = 0;
  uint32_t sequence = 0;  ///< counts the camera's frames, lost ones too
  Timestamp stamp;        ///< of the camera's clock, mapped to the drive's
  Image image;
};

/// Takes frames. Called by a FrameSource's run() only, never concurrently.
class FrameSink {
 public:
  virtual ~FrameSink() = default;
  /// Memory for an image of CV_8UC1, to be filled and given to add(), or dropped.
  virtual Image acquire(cv::Size size_px) = 0;
  virtual void add(const CapturedFrame& frame) = 0;
  /// Called after each wait. Returns how long the source may wait at most before it calls again.
  virtual Duration idle() = 0;
};

/// State of one camera for /diagnostics.
struct CameraStatus {
  std::string device;
  bool streaming = false;
  std::string message;   ///< "streaming GREY", or what is wrong
  uint64_t frames = 0;   ///< taken
  uint64_t lost = 0;     ///< by the numbers of those that came
  uint64_t damaged = 0;  ///< flagged, too short, or not to be decoded
  uint64_t timeouts = 0;
  uint64_t connections = 0;  ///< times that the device was opened
};

/// Where frames come from: cameras, or images of a recorded drive in its place.
class FrameSource {
 public:
  virtual ~FrameSource() = default;
  /// Delivers frames until stop() or the end of what there is. Called once.
  virtual void run(FrameSink* sink) = 0;
  /// Ends run() soon, whatever it waits for; thread safe.
  virtual void stop() = 0;
  /// Per camera; thread safe.
  virtual std::vector<CameraStatus> status() const = 0;
};

}  // namespace vcharge
