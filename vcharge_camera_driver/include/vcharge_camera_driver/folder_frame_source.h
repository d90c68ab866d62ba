#pragma once

#include <memory>
#include <string>
#include <vector>

#include "vcharge_camera_driver/clock_map.h"
#include "vcharge_camera_driver/file_descriptor.h"
#include "vcharge_camera_driver/frame_source.h"

namespace vcharge {

/// Sleeps until a given time or until it is stopped. Thread safe.
class Pacer {
 public:
  Pacer();
  /// Returns false when stopped.
  bool sleepUntil(Timestamp monotonic);
  void stop();

 private:
  FileDescriptor wake_;
};

/// Plays images FOLDER/CAMERA/STAMP_NS.png (or .jpg, .pgm) in real time as if cameras recorded them now; the
/// first pulse is at the start of run(). Images with the same stamp belong to the same pulse.
class FolderFrameSource : public FrameSource {
 public:
  /// Throws InputError naming the folder or file if a camera has no images or a name is not a stamp.
  FolderFrameSource(const std::string& folder, std::vector<std::string> cameras, cv::Size size_px,
                    double frame_rate_hz, bool loop, ClockMap::Clock drive_clock);

  void run(FrameSink* sink) override;
  void stop() override { pacer_.stop(); }
  std::vector<CameraStatus> status() const override;

 private:
  struct File {
    int64_t stamp_ns;
    size_t camera_index;
    std::string path;
  };
  struct State;
  void show(const File& file, Timestamp stamp, uint32_t sequence, FrameSink* sink);

  const cv::Size size_px_;
  const double frame_rate_hz_;
  const bool loop_;
  const ClockMap::Clock drive_clock_;
  std::vector<File> files_;  // sorted by stamp, then camera
  Pacer pacer_;
  std::shared_ptr<State> state_;
};

}  // namespace vcharge
