#pragma once

#include <cstdint>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include <opencv2/core.hpp>

#include "vcharge_camera_driver/file_descriptor.h"
#include "vcharge_camera_driver/gray_converter.h"
#include "vcharge_core/base/options.h"
#include "vcharge_core/base/timestamp.h"

namespace vcharge {

enum class BufferMemory { kMmap, kUserPointer };

template <>
inline std::vector<std::string> enumNames<BufferMemory>() {
  return {"mmap", "userptr"};
}

/// Configuration of a camera.
struct V4l2Options {
  VCHARGE_BEGIN_OPTIONS(V4l2Options);
  VCHARGE_OPTION(double, frame_rate_hz, 12.5, above(0.0).upTo(1000.0), "Rate of the trigger and the camera.");
  VCHARGE_OPTION(std::vector<std::string>, pixel_formats, {}, anyValue(),
                 "Formats in order of preference; empty: all supported ones, fastest conversion first.");
  VCHARGE_OPTION(BufferMemory, memory, BufferMemory::kMmap, anyValue(), "Owner of the memory of frames.");
  VCHARGE_OPTION(std::vector<std::string>, controls, {}, anyValue(),
                 "Controls to set, as name=value with the names printed by list_cameras.");
  VCHARGE_END_OPTIONS();
  void checkFields() const;

  cv::Size image_size_px{1280, 800};  ///< set from the rig
};

/// A control of a camera, except menus and buttons.
struct V4l2Control {
  uint32_t id = 0;
  std::string name;  ///< in the notation of v4l2-ctl: "Exposure Time, Absolute" is exposure_time_absolute
  int32_t minimum = 0, maximum = 0, step = 0, default_value = 0, value = 0;
};

/// A frame in a buffer of the kernel; valid until enqueue().
struct V4l2Frame {
  uint32_t buffer_index = 0;
  uint32_t sequence = 0;
  /// Time of the kernel's CLOCK_MONOTONIC at the end of the frame.
  Timestamp monotonic_stamp;
  bool marks_start = false;      ///< the stamp is that of the start of the exposure instead
  bool has_kernel_stamp = true;  ///< false: the driver's clock is unknown; uses the time of dequeue()
  bool is_damaged = false;       ///< V4L2_BUF_FLAG_ERROR
  const uint8_t* data = nullptr;
  size_t size_bytes = 0;
};

/// An open, streaming V4L2 capture device. All failures throw InputError "<device>: <what>: <reason>"; the
/// destructor stops streaming and closes the device. Not thread safe.
class V4l2Device {
 public:
  /// Opens the device, checks that it captures and streams, negotiates format and rate, sets the controls,
  /// and starts.
  V4l2Device(const std::string& path, const V4l2Options& options);
  ~V4l2Device();
  V4l2Device(const V4l2Device&) = delete;
  V4l2Device& operator=(const V4l2Device&) = delete;

  const std::string& path() const { return path_; }
  int fileDescriptor() const { return fd_.get(); }  ///< readable (poll) when a frame is available
  PixelFormat pixelFormat() const { return format_; }
  cv::Size size() const { return size_; }
  size_t strideBytes() const { return stride_bytes_; }

  /// Takes the oldest filled buffer. Returns false if there is none; does not wait.
  bool dequeue(V4l2Frame* frame);
  /// Returns the frame's buffer to the kernel.
  void enqueue(const V4l2Frame& frame);

  /// Present exposure of each line; nothing if the camera does not tell.
  std::optional<double> exposure_s() const;
  std::vector<V4l2Control> controls() const;
  int32_t control(const std::string& name) const;
  void setControl(const std::string& name, int32_t value);

 private:
  struct Buffer;

  void checkCapabilities() const;
  void negotiate(const V4l2Options& options);
  void allocate();
  void start();
  V4l2Control findControl(const std::string& name) const;
  [[noreturn]] void fail(const std::string& what) const;  // adds the text of errno

  const std::string path_;
  FileDescriptor fd_;
  BufferMemory memory_;
  PixelFormat format_ = PixelFormat::kGrey;
  cv::Size size_;
  size_t stride_bytes_ = 0;
  size_t image_bytes_ = 0;
  std::vector<std::unique_ptr<Buffer>> buffers_;
  bool streaming_ = false;
};

/// Description of a device node for list_cameras.
struct V4l2Description {
  std::string path, card, driver, bus;
  bool captures = false;
  std::vector<std::string>
      formats;  ///< "GREY 1280x800 (12.5, 25 Hz)", with a trailing '*' if the driver does not support it
  std::vector<V4l2Control> controls;
};

/// Throws InputError if the device cannot be opened or is not a V4L2 device.
V4l2Description describeV4l2Device(const std::string& path);
/// Splits "name=value". Throws InputError for anything else.
std::pair<std::string, int32_t> parseControl(const std::string& text);

}  // namespace vcharge
