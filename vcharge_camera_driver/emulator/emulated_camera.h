#pragma once

#include <linux/videodev2.h>

#include <cstdint>
#include <deque>
#include <map>
#include <string>
#include <vector>

#include "camera_config.h"

namespace vcharge::emulator {

/// State of one open file of an emulated camera. Protected by the emulator's mutex.
class EmulatedCamera {
 public:
  /// `application_fd` is returned by open(), `hardware_fd` is the other end of its socket pair; `memory_fd`
  /// holds the frames.
  EmulatedCamera(std::string path, const CameraConfig& config, int application_fd, int hardware_fd,
                 int memory_fd);
  ~EmulatedCamera();
  EmulatedCamera(const EmulatedCamera&) = delete;
  EmulatedCamera& operator=(const EmulatedCamera&) = delete;

  /// Handles an ioctl. Returns 0 or an errno.
  int control(unsigned long request, void* argument);
  int memoryFd() const { return memory_fd_; }

  /// Time of the next frame in nanoseconds of CLOCK_MONOTONIC; INT64_MAX if not streaming.
  int64_t nextDelivery() const;
  /// Delivers due frames; detects that the device's file was removed.
  void work(int64_t now_ns);

 private:
  struct Slot {
    uint8_t* data = nullptr;  // user pointer; null if the buffer is in memory_fd_
    bool painted = false;
  };
  struct Done {
    uint32_t index = 0, sequence = 0, flags = 0, bytes_used = 0;
    int64_t stamp_ns = 0;
  };
  static constexpr int kNumControls = 3;

  int answer(unsigned long request, void* argument);
  void describe(v4l2_capability* capability) const;
  int enumerateFormat(v4l2_fmtdesc* format) const;
  int enumerateSize(v4l2_frmsizeenum* size) const;
  int enumerateRate(v4l2_frmivalenum* rate) const;
  void agree(v4l2_format* format);
  int allocate(v4l2_requestbuffers* request);
  int queryBuffer(v4l2_buffer* buffer) const;
  int enqueue(const v4l2_buffer& buffer);
  int dequeue(v4l2_buffer* buffer);
  int queryControl(v4l2_queryctrl* control) const;
  int accessControl(v4l2_control* control, bool set);
  void stop();
  void deliver(uint64_t pulse);
  void paint(uint32_t index, uint64_t pulse);
  uint8_t* memory(uint32_t index);
  int64_t period() const;
  bool isFile() const;

  const std::string path_;
  const CameraConfig config_;
  const int application_fd_;
  int hardware_fd_;
  const int memory_fd_;
  uint64_t inode_ = 0;
  bool unplugged_ = false;
  bool streaming_ = false;
  uint32_t fourcc_ = V4L2_PIX_FMT_GREY;
  uint32_t image_bytes_ = 0;
  uint8_t* mapped_ = nullptr;
  size_t mapped_bytes_ = 0;
  std::vector<Slot> slots_;
  std::vector<uint8_t> jpeg_;
  std::deque<uint32_t> queued_;
  std::deque<Done> done_;
  uint64_t next_pulse_ = 0;
  uint64_t frames_ = 0;
  int controls_[kNumControls] = {100, 0, 0};
};

}  // namespace vcharge::emulator
