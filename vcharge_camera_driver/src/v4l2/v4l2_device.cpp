#include "vcharge_camera_driver/v4l2_device.h"

#include <fcntl.h>
#include <linux/videodev2.h>
#include <sys/mman.h>

#include <algorithm>
#include <cmath>
#include <cstdlib>
#include <cstring>

#include "v4l2/v4l2_controls.h"
#include "v4l2/v4l2_ioctl.h"
#include "vcharge_camera_driver/clock_map.h"
#include "vcharge_core/base/error.h"

namespace vcharge {
namespace {

/// Number of frames that the kernel can buffer.
constexpr uint32_t kNumBuffers = 4;
constexpr long kPageBytes = 4096;

bool hasFlag(uint32_t flags, uint32_t flag) {
  return (flags & flag) != 0;
}

std::string sizeText(uint32_t width, uint32_t height) {
  return std::to_string(width) + "x" + std::to_string(height);
}

}  // namespace

void V4l2Options::checkFields() const {
  const std::vector<std::string> known = pixelFormatNames();
  for (const std::string& name : pixel_formats) {
    if (std::find(known.begin(), known.end(), name) == known.end()) {
      throw std::invalid_argument("pixel_formats: unknown format '" + name + "'");
    }
  }
  for (const std::string& text : controls) {
    try {
      parseControl(text);
    } catch (const InputError& error) {
      throw std::invalid_argument(std::string("controls: ") + error.what());
    }
  }
}

// Memory of one frame, mapped from the kernel or allocated by this process.
struct V4l2Device::Buffer {
  Buffer(void* start, size_t size, bool mapped) : data(start), size_bytes(size), is_mapped(mapped) {}
  ~Buffer() {
    if (is_mapped) {
      munmap(data, size_bytes);
    } else {
      std::free(data);
    }
  }
  Buffer(const Buffer&) = delete;
  Buffer& operator=(const Buffer&) = delete;

  void* data;
  size_t size_bytes;
  bool is_mapped;
};

V4l2Device::V4l2Device(const std::string& path, const V4l2Options& options)
    : path_(path), fd_(::open(path.c_str(), O_RDWR | O_NONBLOCK | O_CLOEXEC)), memory_(options.memory) {
  options.validate();
  if (!fd_) {
    fail("cannot be opened");
  }
  checkCapabilities();
  negotiate(options);
  for (const std::string& text : options.controls) {
    const auto [name, value] = parseControl(text);
    setControl(name, value);
  }
  allocate();
  start();
}

V4l2Device::~V4l2Device() {
  if (streaming_) {
    int type = V4L2_BUF_TYPE_VIDEO_CAPTURE;
    v4l2Ioctl(fd_.get(), VIDIOC_STREAMOFF, &type);  // fails for an unplugged camera, which needs no stop
  }
}

void V4l2Device::fail(const std::string& what) const {
  throw InputError(path_ + ": " + what + ": " + std::strerror(errno));
}

void V4l2Device::checkCapabilities() const {
  v4l2_capability capability{};
  if (v4l2Ioctl(fd_.get(), VIDIOC_QUERYCAP, &capability) != 0) {
    fail("is not a V4L2 device");
  }
  const uint32_t flags = hasFlag(capability.capabilities, V4L2_CAP_DEVICE_CAPS) ? capability.device_caps
                                                                                : capability.capabilities;
  if (!hasFlag(flags, V4L2_CAP_VIDEO_CAPTURE)) {
    throw InputError(path_ + ": is not a (single-planar) video capture device");
  }
  if (!hasFlag(flags, V4L2_CAP_STREAMING)) {
    throw InputError(path_ + ": cannot stream");
  }
}

void V4l2Device::negotiate(const V4l2Options& options) {
  std::vector<uint32_t> offered;
  v4l2_fmtdesc description{};
  description.type = V4L2_BUF_TYPE_VIDEO_CAPTURE;
  for (; v4l2Ioctl(fd_.get(), VIDIOC_ENUM_FMT, &description) == 0; ++description.index) {
    offered.push_back(description.pixelformat);
  }
  const std::vector<std::string> wanted =
      options.pixel_formats.empty() ? pixelFormatNames() : options.pixel_formats;
  std::string refused;
  for (const std::string& name : wanted) {
    const auto& all = allPixelFormats();
    const auto format =
        *std::find_if(all.begin(), all.end(), [&](PixelFormat each) { return toString(each) == name; });
    if (std::find(offered.begin(), offered.end(), fourccOf(format)) == offered.end()) {
      continue;
    }
    v4l2_format request{};
    request.type = V4L2_BUF_TYPE_VIDEO_CAPTURE;
    request.fmt.pix.width = static_cast<uint32_t>(options.image_size_px.width);
    request.fmt.pix.height = static_cast<uint32_t>(options.image_size_px.height);
    request.fmt.pix.pixelformat = fourccOf(format);
    request.fmt.pix.field = V4L2_FIELD_NONE;
    if (v4l2Ioctl(fd_.get(), VIDIOC_S_FMT, &request) != 0) {
      refused += "; " + name + ": " + std::strerror(errno);
      continue;
    }
    // The driver answers with the nearest supported format.
    const v4l2_pix_format& answer = request.fmt.pix;
    if (answer.pixelformat != fourccOf(format) ||
        answer.width != static_cast<uint32_t>(options.image_size_px.width) ||
        answer.height != static_cast<uint32_t>(options.image_size_px.height)) {
      refused += "; " + name + ": offers " + fourccText(answer.pixelformat) + " " +
                 sizeText(answer.width, answer.height);
      continue;
    }
    format_ = format;
    size_ = options.image_size_px;
    stride_bytes_ = std::max<size_t>(answer.bytesperline, bytesPerRow(format, options.image_size_px.width));
    image_bytes_ =
        std::max<size_t>(answer.sizeimage, stride_bytes_ * static_cast<size_t>(options.image_size_px.height));
    if (image_bytes_ == 0) {
      throw InputError(path_ + ": the driver reports no image size");
    }
    v4l2_streamparm rate{};  // best effort: a triggered camera may have no rate
    rate.type = V4L2_BUF_TYPE_VIDEO_CAPTURE;
    rate.parm.capture.timeperframe = {1000,
                                      static_cast<uint32_t>(std::lround(1000.0 * options.frame_rate_hz))};
    v4l2Ioctl(fd_.get(), VIDIOC_S_PARM, &rate);
    return;
  }
  std::string names;
  for (const uint32_t fourcc : offered) {
    names += (names.empty() ? "" : ", ") + fourccText(fourcc);
  }
  throw InputError(path_ + ": no agreement on " +
                   sizeText(static_cast<uint32_t>(options.image_size_px.width),
                            static_cast<uint32_t>(options.image_size_px.height)) +
                   " pixels in a supported and requested format; the camera has " +
                   (names.empty() ? "none" : names) + refused);
}

void V4l2Device::allocate() {
  v4l2_requestbuffers request{};
  request.count = kNumBuffers;
  request.type = V4L2_BUF_TYPE_VIDEO_CAPTURE;
  request.memory = memory_ == BufferMemory::kMmap ? V4L2_MEMORY_MMAP : V4L2_MEMORY_USERPTR;
  if (v4l2Ioctl(fd_.get(), VIDIOC_REQBUFS, &request) != 0) {
    fail("provides no buffers (memory: " + enumNames<BufferMemory>()[static_cast<size_t>(memory_)] + ")");
  }
  if (request.count < 2) {
    throw InputError(path_ + ": gives " + std::to_string(request.count) + " buffers, needed are 2");
  }
  for (uint32_t i = 0; i < request.count; ++i) {
    if (memory_ == BufferMemory::kUserPointer) {
      const size_t rounded = (image_bytes_ + kPageBytes - 1) / kPageBytes * kPageBytes;
      void* start = std::aligned_alloc(kPageBytes, rounded);
      check(start != nullptr, "V4l2Device: out of memory");
      buffers_.push_back(std::make_unique<Buffer>(start, rounded, false));
      continue;
    }
    v4l2_buffer buffer{};
    buffer.type = V4L2_BUF_TYPE_VIDEO_CAPTURE;
    buffer.memory = V4L2_MEMORY_MMAP;
    buffer.index = i;
    if (v4l2Ioctl(fd_.get(), VIDIOC_QUERYBUF, &buffer) != 0) {
      fail("does not report the location of buffer " + std::to_string(i) + " is");
    }
    void* start =
        mmap(nullptr, buffer.length, PROT_READ | PROT_WRITE, MAP_SHARED, fd_.get(), buffer.m.offset);
    if (start == MAP_FAILED) {
      fail("buffer " + std::to_string(i) + " cannot be mapped");
    }
    buffers_.push_back(std::make_unique<Buffer>(start, buffer.length, true));
  }
}

void V4l2Device::start() {
  for (uint32_t i = 0; i < buffers_.size(); ++i) {
    V4l2Frame frame;
    frame.buffer_index = i;
    enqueue(frame);
  }
  int type = V4L2_BUF_TYPE_VIDEO_CAPTURE;
  if (v4l2Ioctl(fd_.get(), VIDIOC_STREAMON, &type) != 0) {
    fail("does not start to stream");
  }
  streaming_ = true;
}

bool V4l2Device::dequeue(V4l2Frame* frame) {
  v4l2_buffer buffer{};
  buffer.type = V4L2_BUF_TYPE_VIDEO_CAPTURE;
  buffer.memory = memory_ == BufferMemory::kMmap ? V4L2_MEMORY_MMAP : V4L2_MEMORY_USERPTR;
  if (v4l2Ioctl(fd_.get(), VIDIOC_DQBUF, &buffer) != 0) {
    if (errno == EAGAIN) {
      return false;
    }
    fail("gives no frame");
  }
  if (buffer.index >= buffers_.size()) {
    throw InputError(path_ + ": returns a buffer " + std::to_string(buffer.index) + " that it does not have");
  }
  const Buffer& memory = *buffers_[buffer.index];
  frame->buffer_index = buffer.index;
  frame->sequence = buffer.sequence;
  frame->has_kernel_stamp =
      (buffer.flags & V4L2_BUF_FLAG_TIMESTAMP_MASK) == V4L2_BUF_FLAG_TIMESTAMP_MONOTONIC;
  frame->monotonic_stamp = frame->has_kernel_stamp
                               ? Timestamp::fromNanoseconds(int64_t{1000000000} * buffer.timestamp.tv_sec +
                                                            int64_t{1000} * buffer.timestamp.tv_usec)
                               : monotonicNow();
  frame->marks_start = (buffer.flags & V4L2_BUF_FLAG_TSTAMP_SRC_MASK) == V4L2_BUF_FLAG_TSTAMP_SRC_SOE;
  frame->is_damaged = hasFlag(buffer.flags, V4L2_BUF_FLAG_ERROR);
  frame->data = static_cast<const uint8_t*>(memory.data);
  frame->size_bytes = std::min<size_t>(buffer.bytesused, memory.size_bytes);
  return true;
}

void V4l2Device::enqueue(const V4l2Frame& frame) {
  const Buffer& memory = *buffers_.at(frame.buffer_index);
  v4l2_buffer buffer{};
  buffer.type = V4L2_BUF_TYPE_VIDEO_CAPTURE;
  buffer.index = frame.buffer_index;
  if (memory_ == BufferMemory::kMmap) {
    buffer.memory = V4L2_MEMORY_MMAP;
  } else {
    buffer.memory = V4L2_MEMORY_USERPTR;
    buffer.m.userptr = reinterpret_cast<unsigned long>(memory.data);
    buffer.length = static_cast<uint32_t>(memory.size_bytes);
  }
  if (v4l2Ioctl(fd_.get(), VIDIOC_QBUF, &buffer) != 0) {
    fail("does not take buffer " + std::to_string(frame.buffer_index));
  }
}

std::optional<double> V4l2Device::exposure_s() const {
  constexpr double kUnit_s = 1e-4;
  v4l2_control request{V4L2_CID_EXPOSURE_ABSOLUTE, 0};
  if (v4l2Ioctl(fd_.get(), VIDIOC_G_CTRL, &request) != 0 || request.value <= 0) {
    return std::nullopt;
  }
  return kUnit_s * request.value;
}

std::vector<V4l2Control> V4l2Device::controls() const {
  return listControls(fd_.get());
}

V4l2Control V4l2Device::findControl(const std::string& name) const {
  std::string names;
  for (const V4l2Control& control : controls()) {
    if (control.name == name) {
      return control;
    }
    names += (names.empty() ? "" : ", ") + control.name;
  }
  throw InputError(path_ + ": has no control '" + name + "', has " + (names.empty() ? "none" : names));
}

int32_t V4l2Device::control(const std::string& name) const {
  return findControl(name).value;
}

void V4l2Device::setControl(const std::string& name, int32_t value) {
  const V4l2Control control = findControl(name);
  if (value < control.minimum || value > control.maximum) {
    throw InputError(path_ + ": control " + name + ": expected a value in [" +
                     std::to_string(control.minimum) + ", " + std::to_string(control.maximum) + "], got " +
                     std::to_string(value));
  }
  v4l2_control request{control.id, value};
  if (v4l2Ioctl(fd_.get(), VIDIOC_S_CTRL, &request) != 0) {
    fail("control " + name + " cannot be set to " + std::to_string(value));
  }
}

}  // namespace vcharge
