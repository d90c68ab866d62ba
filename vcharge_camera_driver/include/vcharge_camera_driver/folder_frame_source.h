#pragma once

#include <memory>
#include <string>
#include <vector>

#include "vcharge_camera_driver/clock_map.h"
#include "vcharge_camera_driver/file_descriptor.h"
#include "vcharge_camera_driver/frame_source.h"

namespace vcharge {

/// Lets a caller sleep until a time or until it is stopped. Thread safe.
class Pacer {
 public:
  Pacer();
  /// False when stopped.
  bool sleepUntil(Timestamp monotonic);
  void stop();

 private:
  FileDescriptor wake_;
};

/// Images FOLDER/CAMERA/STAMP_NS.png (or .jpg, .pgm), shown in real time as if cameras made them now: the
/// first pulse is when run() begins. Images of the cameras with the same stamp are of one pulse.
class FolderFrameSource : public FrameSource {
 public:
  /// InputError naming the folder or file, where a camera has no images or a name is no stamp.
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
  std::vector<File> files_;  // by stamp, then camera
  Pacer pacer_;
  std::shared_ptr<State> state_;
};

}  // namespace vcharge
