#include "emulated_camera.h"

#include <sys/mman.h>
#include <sys/socket.h>
#include <sys/stat.h>
#include <turbojpeg.h>
#include <unistd.h>

#include <cerrno>
#include <cmath>
#include <cstdio>
#include <cstring>
#include <ctime>
#include <limits>

namespace vcharge::emulator {
namespace {

constexpr int kPulseBits = 32;

struct ControlRule {
  uint32_t id;
  const char* name;
  int type, minimum, maximum, initial;
};
constexpr ControlRule kControls[] = {
    {V4L2_CID_GAIN, "Gain", V4L2_CTRL_TYPE_INTEGER, 0, 255, 100},
    {V4L2_CID_EXPOSURE_AUTO, "Auto Exposure", V4L2_CTRL_TYPE_MENU, 0, 3, 0},
    {V4L2_CID_EXPOSURE_ABSOLUTE, "Exposure Time, Absolute", V4L2_CTRL_TYPE_INTEGER, 0, 10000, 0},
};

uint32_t fourccOf(const std::string& name) {
  uint32_t code = 0;
  for (size_t i = 0; i < 4; ++i) {
    code |= static_cast<uint32_t>(i < name.size() ? name[i] : ' ') << (8 * i);
  }
  return code;
}

uint32_t bytesPerPixel(uint32_t fourcc) {
  switch (fourcc) {
    case V4L2_PIX_FMT_Y10:
    case V4L2_PIX_FMT_Y12:
    case V4L2_PIX_FMT_Y16:
    case V4L2_PIX_FMT_YUYV:
    case V4L2_PIX_FMT_UYVY:
      return 2;
    case V4L2_PIX_FMT_RGB24:
      return 3;
    default:
      return 1;
  }
}

// A pseudo-random number in [-limit, limit], always the same for a pulse and camera.
int64_t jitterOf(uint64_t pulse, const std::string& path, int64_t limit) {
  uint64_t hash = pulse * 0x9e3779b97f4a7c15ULL;
  for (const char character : path) {
    hash = (hash ^ static_cast<uint8_t>(character)) * 0x100000001b3ULL;
  }
  hash ^= hash >> 29;
  return limit == 0 ? 0 : static_cast<int64_t>(hash % static_cast<uint64_t>(2 * limit + 1)) - limit;
}

}  // namespace

EmulatedCamera::EmulatedCamera(std::string path, const CameraConfig& config, int application_fd,
                               int hardware_fd, int memory_fd)
    : path_(std::move(path)),
      config_(config),
      application_fd_(application_fd),
      hardware_fd_(hardware_fd),
      memory_fd_(memory_fd),
      fourcc_(fourccOf(config.formats.front())) {
  struct stat status {};
  stat(path_.c_str(), &status);
  inode_ = status.st_ino;
}

EmulatedCamera::~EmulatedCamera() {
  if (mapped_ != nullptr) {
    munmap(mapped_, mapped_bytes_);
  }
  close(hardware_fd_);
  close(memory_fd_);
}

int64_t EmulatedCamera::period() const {
  return std::llround(1e9 / config_.rate_hz);
}

bool EmulatedCamera::isFile() const {
  struct stat status {};
  return stat(path_.c_str(), &status) == 0 && status.st_ino == inode_;
}

int EmulatedCamera::control(unsigned long request, void* argument) {
  if (unplugged_) {
    return ENODEV;
  }
  return answer(request, argument);
}

int EmulatedCamera::answer(unsigned long request, void* argument) {
  const auto failing = [&](const char* name) {
    const auto found = config_.failures.find(name);
    return found == config_.failures.end() ? 0 : found->second;
  };
  switch (request) {
    case VIDIOC_QUERYCAP:
      if (failing("QUERYCAP") == 0) describe(static_cast<v4l2_capability*>(argument));
      return failing("QUERYCAP");
    case VIDIOC_ENUM_FMT:
      return enumerateFormat(static_cast<v4l2_fmtdesc*>(argument));
    case VIDIOC_ENUM_FRAMESIZES:
      return enumerateSize(static_cast<v4l2_frmsizeenum*>(argument));
    case VIDIOC_ENUM_FRAMEINTERVALS:
      return enumerateRate(static_cast<v4l2_frmivalenum*>(argument));
    case VIDIOC_S_FMT:
      if (failing("S_FMT") == 0) agree(static_cast<v4l2_format*>(argument));
      return failing("S_FMT");
    case VIDIOC_S_PARM:
      return failing("S_PARM");
    case VIDIOC_REQBUFS:
      return failing("REQBUFS") != 0 ? failing("REQBUFS")
                                     : allocate(static_cast<v4l2_requestbuffers*>(argument));
    case VIDIOC_QUERYBUF:
      return failing("QUERYBUF") != 0 ? failing("QUERYBUF")
                                      : queryBuffer(static_cast<v4l2_buffer*>(argument));
    case VIDIOC_QBUF:
      return failing("QBUF") != 0 ? failing("QBUF") : enqueue(*static_cast<v4l2_buffer*>(argument));
    case VIDIOC_DQBUF:
      return failing("DQBUF") != 0 ? failing("DQBUF") : dequeue(static_cast<v4l2_buffer*>(argument));
    case VIDIOC_STREAMON: {
      if (failing("STREAMON") != 0) return failing("STREAMON");
      timespec now{};
      clock_gettime(CLOCK_MONOTONIC, &now);
      next_pulse_ = static_cast<uint64_t>((1000000000LL * now.tv_sec + now.tv_nsec) / period()) + 1;
      frames_ = 0;
      streaming_ = true;
      return 0;
    }
    case VIDIOC_STREAMOFF:
      stop();
      return 0;
    case VIDIOC_QUERYCTRL:
      return queryControl(static_cast<v4l2_queryctrl*>(argument));
    case VIDIOC_G_CTRL:
      return accessControl(static_cast<v4l2_control*>(argument), false);
    case VIDIOC_S_CTRL:
      return failing("S_CTRL") != 0 ? failing("S_CTRL")
                                    : accessControl(static_cast<v4l2_control*>(argument), true);
    default:
      return ENOTTY;
  }
}

void EmulatedCamera::describe(v4l2_capability* capability) const {
  *capability = {};
  const auto write = [](__u8* field, size_t size, const std::string& text) {
    std::snprintf(reinterpret_cast<char*>(field), size, "%s", text.c_str());
  };
  write(capability->driver, sizeof(capability->driver), "emulated");
  write(capability->card, sizeof(capability->card), "Emulated camera");
  write(capability->bus_info, sizeof(capability->bus_info), "platform:emulated");
  capability->device_caps = V4L2_CAP_VIDEO_CAPTURE | V4L2_CAP_STREAMING;
  if (config_.capabilities == "output") capability->device_caps = V4L2_CAP_VIDEO_OUTPUT | V4L2_CAP_STREAMING;
  if (config_.capabilities == "no_streaming") capability->device_caps = V4L2_CAP_VIDEO_CAPTURE;
  capability->capabilities = capability->device_caps | V4L2_CAP_DEVICE_CAPS;
}

int EmulatedCamera::enumerateFormat(v4l2_fmtdesc* format) const {
  if (format->index >= config_.formats.size()) return EINVAL;
  format->pixelformat = fourccOf(config_.formats[format->index]);
  return 0;
}

int EmulatedCamera::enumerateSize(v4l2_frmsizeenum* size) const {
  if (size->index > 0) return EINVAL;
  size->type = V4L2_FRMSIZE_TYPE_DISCRETE;
  size->discrete = {config_.width, config_.height};
  return 0;
}

int EmulatedCamera::enumerateRate(v4l2_frmivalenum* rate) const {
  if (rate->index > 0) return EINVAL;
  rate->type = V4L2_FRMIVAL_TYPE_DISCRETE;
  rate->discrete = {1000, static_cast<uint32_t>(std::lround(1000 * config_.rate_hz))};
  return 0;
}

// Like a driver, replaces the requested format by the nearest supported one.
void EmulatedCamera::agree(v4l2_format* format) {
  v4l2_pix_format& pixels = format->fmt.pix;
  fourcc_ = fourccOf(config_.formats.front());
  for (const std::string& name : config_.formats) {
    fourcc_ = fourccOf(name) == pixels.pixelformat ? pixels.pixelformat : fourcc_;
  }
  pixels.pixelformat = fourcc_;
  pixels.width = config_.width;
  pixels.height = config_.height;
  pixels.bytesperline = fourcc_ == V4L2_PIX_FMT_MJPEG ? 0 : config_.width * bytesPerPixel(fourcc_);
  image_bytes_ = config_.width * config_.height * bytesPerPixel(fourcc_);
  pixels.sizeimage = image_bytes_;
}

int EmulatedCamera::allocate(v4l2_requestbuffers* request) {
  if (streaming_) return EBUSY;
  constexpr uint32_t kPage = 4096;
  const uint32_t slot_bytes = (image_bytes_ + kPage - 1) / kPage * kPage;
  slots_.assign(request->count, Slot());
  queued_.clear();
  if (request->memory == V4L2_MEMORY_MMAP) {
    mapped_bytes_ = static_cast<size_t>(slot_bytes) * request->count;
    if (ftruncate(memory_fd_, static_cast<off_t>(mapped_bytes_)) != 0) return ENOMEM;
    mapped_ = static_cast<uint8_t*>(
        mmap(nullptr, mapped_bytes_, PROT_READ | PROT_WRITE, MAP_SHARED, memory_fd_, 0));
  }
  return 0;
}

int EmulatedCamera::queryBuffer(v4l2_buffer* buffer) const {
  if (buffer->index >= slots_.size()) return EINVAL;
  buffer->length = static_cast<uint32_t>(mapped_bytes_ / slots_.size());
  buffer->m.offset = buffer->length * buffer->index;
  return 0;
}

int EmulatedCamera::enqueue(const v4l2_buffer& buffer) {
  if (buffer.index >= slots_.size()) return EINVAL;
  if (buffer.memory == V4L2_MEMORY_USERPTR) {
    if (buffer.length < image_bytes_) return EINVAL;
    slots_[buffer.index].data = reinterpret_cast<uint8_t*>(buffer.m.userptr);
  }
  queued_.push_back(buffer.index);
  return 0;
}

int EmulatedCamera::dequeue(v4l2_buffer* buffer) {
  if (!streaming_) return EINVAL;
  if (done_.empty()) return EAGAIN;
  char token = 0;
  recv(application_fd_, &token, 1, MSG_DONTWAIT);
  const Done done = done_.front();
  done_.pop_front();
  buffer->index = done.index;
  buffer->sequence = done.sequence;
  buffer->flags = done.flags;
  buffer->bytesused = done.bytes_used;
  buffer->timestamp = {done.stamp_ns / 1000000000, done.stamp_ns % 1000000000 / 1000};
  return 0;
}

int EmulatedCamera::queryControl(v4l2_queryctrl* control) const {
  const bool next = (control->id & V4L2_CTRL_FLAG_NEXT_CTRL) != 0;
  const uint32_t id = control->id & ~V4L2_CTRL_FLAG_NEXT_CTRL;
  for (const ControlRule& rule : kControls) {
    if (next ? rule.id <= id : rule.id != id) continue;
    *control = {};
    control->id = rule.id;
    control->type = static_cast<uint32_t>(rule.type);
    std::snprintf(reinterpret_cast<char*>(control->name), sizeof(control->name), "%s", rule.name);
    control->minimum = rule.minimum;
    control->maximum = rule.maximum;
    control->step = 1;
    control->default_value = rule.initial;
    return 0;
  }
  return EINVAL;
}

int EmulatedCamera::accessControl(v4l2_control* control, bool set) {
  for (int i = 0; i < kNumControls; ++i) {
    if (kControls[i].id != control->id) continue;
    (set ? controls_[i] : control->value) = set ? control->value : controls_[i];
    return 0;
  }
  return EINVAL;
}

void EmulatedCamera::stop() {
  streaming_ = false;
  queued_.clear();
  done_.clear();
  char token = 0;
  while (recv(application_fd_, &token, 1, MSG_DONTWAIT) > 0) {
  }
}

int64_t EmulatedCamera::nextDelivery() const {
  if (!streaming_ || unplugged_) {
    return std::numeric_limits<int64_t>::max();
  }
  return static_cast<int64_t>(next_pulse_) * period() + config_.readout_us * 1000;
}

void EmulatedCamera::work(int64_t now_ns) {
  if (!unplugged_ && !isFile()) {
    unplugged_ = true;
    shutdown(hardware_fd_, SHUT_RDWR);  // from now on, poll() reports POLLHUP
  }
  while (nextDelivery() <= now_ns) {
    deliver(next_pulse_++);
  }
}

void EmulatedCamera::deliver(uint64_t pulse) {
  const uint64_t number = frames_++;
  const auto isHit = [&](uint64_t every) { return every != 0 && number % every == every - 1; };
  if (isHit(config_.drop_every) || (config_.silent_after != 0 && number >= config_.silent_after) ||
      queued_.empty()) {
    return;
  }
  Done done;
  done.index = queued_.front();
  queued_.pop_front();
  done.sequence = static_cast<uint32_t>(number);
  done.flags = config_.unknown_clock ? V4L2_BUF_FLAG_TIMESTAMP_UNKNOWN : V4L2_BUF_FLAG_TIMESTAMP_MONOTONIC;
  done.flags |= config_.stamps_start ? V4L2_BUF_FLAG_TSTAMP_SRC_SOE : V4L2_BUF_FLAG_TSTAMP_SRC_EOF;
  done.flags |= isHit(config_.damage_every) ? V4L2_BUF_FLAG_ERROR : 0U;
  done.stamp_ns = static_cast<int64_t>(pulse) * period() +
                  1000 * (config_.exposure_us + jitterOf(pulse, path_, config_.jitter_us));
  paint(done.index, pulse);
  done.bytes_used = fourcc_ == V4L2_PIX_FMT_MJPEG ? static_cast<uint32_t>(jpeg_.size()) : image_bytes_;
  done.bytes_used /= isHit(config_.short_every) ? 2 : 1;
  done_.push_back(done);
  const char token = 1;
  send(hardware_fd_, &token, 1, MSG_DONTWAIT | MSG_NOSIGNAL);
}

uint8_t* EmulatedCamera::memory(uint32_t index) {
  return slots_[index].data != nullptr ? slots_[index].data : mapped_ + mapped_bytes_ / slots_.size() * index;
}

// Paints a gray ramp once, then encodes the pulse's number in the first pixels: white for a one, lowest bit
// first.
void EmulatedCamera::paint(uint32_t index, uint64_t pulse) {
  uint8_t* data = memory(index);
  if (fourcc_ == V4L2_PIX_FMT_MJPEG) {
    if (jpeg_.empty()) {
      std::vector<uint8_t> ramp(static_cast<size_t>(config_.width) * config_.height);
      for (size_t i = 0; i < ramp.size(); ++i) {
        ramp[i] = static_cast<uint8_t>(255 * (i % config_.width) / config_.width);
      }
      tjhandle encoder = tjInitCompress();
      unsigned char* bytes = nullptr;
      unsigned long size = 0;
      tjCompress2(encoder, ramp.data(), static_cast<int>(config_.width), 0, static_cast<int>(config_.height),
                  TJPF_GRAY, &bytes, &size, TJSAMP_GRAY, 80, 0);
      jpeg_.assign(bytes, bytes + size);
      tjFree(bytes);
      tjDestroy(encoder);
    }
    std::memcpy(data, jpeg_.data(), jpeg_.size());
    return;
  }
  const uint32_t width = bytesPerPixel(fourcc_);
  if (!slots_[index].painted) {
    for (uint32_t i = 0; i < image_bytes_; ++i) {
      data[i] = static_cast<uint8_t>(i / width % config_.width);
    }
    slots_[index].painted = true;
  }
  for (int bit = 0; bit < kPulseBits; ++bit) {
    std::memset(data + static_cast<size_t>(bit) * width, (pulse >> bit & 1) != 0 ? 255 : 0, width);
  }
}

}  // namespace vcharge::emulator
