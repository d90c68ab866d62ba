#include "vcharge_camera_driver/v4l2_frame_source.h"

#include <poll.h>
#include <sys/eventfd.h>

#include <algorithm>
#include <cerrno>
#include <cmath>

#include "vcharge_core/base/error.h"

namespace vcharge {
namespace {

constexpr Duration kClockPeriod = std::chrono::seconds(1);
constexpr Duration kLongestWait = std::chrono::seconds(1);
/// Time after which a rate is precise: stamps jitter by a millisecond.
constexpr double kMinRateTime_s = 5.0;

int toPollTimeout(Duration wait) {
  // Rounds up: waking up slightly too early would cause a busy loop until the deadline.
  const auto milliseconds =
      std::chrono::ceil<std::chrono::milliseconds>(std::clamp(wait, Duration(0), kLongestWait));
  return static_cast<int>(milliseconds.count());
}

/// Time from a frame's stamp to the middle of the exposure of its middle line. Lines begin their exposure one
/// after the other; the last one is read out when the frame ends.
Duration toMiddleOfExposure(const V4l2Frame& frame, double exposure_s, double readout_s) {
  return durationFromSeconds((frame.marks_start ? 0.5 : -0.5) * (exposure_s + readout_s));
}

}  // namespace

struct V4l2FrameSource::Camera {
  std::unique_ptr<V4l2Device> device;
  GrayConverter converter;
  Timestamp next_attempt;  // on the monotonic clock, like last_frame
  Timestamp last_frame;
  std::optional<uint32_t> last_sequence;
  Timestamp first_stamp;  // of the kernel, since the frames' numbers began, like the next member
  uint32_t first_sequence = 0;
  double readout_s = 0.0;
  CameraStatus status;
};

V4l2FrameSource::V4l2FrameSource(std::vector<std::string> devices, const V4l2FrameSourceOptions& options,
                                 ClockMap::Clock drive_clock)
    : options_(options), clock_(std::move(drive_clock)), wake_(eventfd(0, EFD_CLOEXEC | EFD_NONBLOCK)) {
  options.validate();
  check(static_cast<bool>(wake_), "V4l2FrameSource: no event descriptor");
  check(options.readouts_s.empty() || options.readouts_s.size() == devices.size(),
        "V4l2FrameSource: expected a readout time of each camera, or none");
  for (std::string& device : devices) {
    cameras_.push_back(std::make_unique<Camera>());
    cameras_.back()->status.device = std::move(device);
    cameras_.back()->status.message = "not opened yet";
    cameras_.back()->readout_s = options.readouts_s.empty() ? 0.0 : options.readouts_s[cameras_.size() - 1];
  }
}

V4l2FrameSource::~V4l2FrameSource() = default;

void V4l2FrameSource::stop() {
  eventfd_write(wake_.get(), 1);
}

std::vector<CameraStatus> V4l2FrameSource::status() const {
  const std::lock_guard<std::mutex> lock(mutex_);
  std::vector<CameraStatus> all;
  for (const auto& camera : cameras_) {
    all.push_back(camera->status);
  }
  return all;
}

void V4l2FrameSource::connect(Camera* camera, Timestamp now) {
  try {
    camera->device = std::make_unique<V4l2Device>(camera->status.device, options_.capture);
    camera->last_frame = now;
    camera->last_sequence.reset();
    const std::lock_guard<std::mutex> lock(mutex_);
    camera->status.streaming = true;
    camera->status.message = "streaming " + toString(camera->device->pixelFormat());
    camera->status.exposure_s = camera->device->exposure_s();
    camera->status.rate_hz.reset();
    ++camera->status.connections;
  } catch (const InputError& error) {
    disconnect(camera, error.what(), now);
  }
}

void V4l2FrameSource::disconnect(Camera* camera, const std::string& reason, Timestamp now) {
  camera->device.reset();
  camera->next_attempt = now + durationFromSeconds(options_.reconnect_s);
  const std::lock_guard<std::mutex> lock(mutex_);
  camera->status.streaming = false;
  camera->status.message = reason;
}

void V4l2FrameSource::updateExposures() {
  for (const auto& camera : cameras_) {
    if (camera->device) {
      const std::optional<double> exposure_s = camera->device->exposure_s();
      const std::lock_guard<std::mutex> lock(mutex_);
      camera->status.exposure_s = exposure_s;
    }
  }
}

Duration V4l2FrameSource::maintain(Timestamp now) {
  const Duration timeout = durationFromSeconds(options_.timeout_s);
  Duration wait = kLongestWait;
  for (const auto& camera : cameras_) {
    if (camera->device && now - camera->last_frame >= timeout) {
      {
        const std::lock_guard<std::mutex> lock(mutex_);
        ++camera->status.timeouts;
      }
      disconnect(camera.get(),
                 camera->status.device + ": no frame for " + std::to_string(options_.timeout_s) +
                     " s: does the trigger run?",
                 now);
    }
    if (!camera->device && now >= camera->next_attempt) {
      connect(camera.get(), now);
    }
    wait = std::min(wait, camera->device ? camera->last_frame + timeout - now : camera->next_attempt - now);
  }
  return wait;
}

bool V4l2FrameSource::take(size_t index, const V4l2Frame& frame, FrameSink* sink) {
  Camera& camera = *cameras_[index];
  CapturedFrame captured;
  captured.camera_index = index;
  captured.sequence = frame.sequence;
  captured.stamp =
      clock_.toDriveTime(frame.monotonic_stamp +
                         toMiddleOfExposure(frame, camera.status.exposure_s.value_or(0.0), camera.readout_s));
  captured.image = sink->acquire(camera.device->size());
  std::string problem = frame.is_damaged ? "flagged as damaged by its driver" : "";
  if (problem.empty()) {
    problem = camera.converter.convert(camera.device->pixelFormat(), frame.data, frame.size_bytes,
                                       camera.device->strideBytes(), &captured.image.pixels);
  }
  const std::string format = toString(camera.device->pixelFormat());
  camera.device->enqueue(frame);  // first, because the camera needs its buffers while the sink works

  {
    const std::lock_guard<std::mutex> lock(mutex_);
    CameraStatus& status = camera.status;
    ++(problem.empty() ? status.frames : status.damaged);
    if (!camera.last_sequence || frame.sequence <= *camera.last_sequence) {
      camera.first_stamp = frame.monotonic_stamp;
      camera.first_sequence = frame.sequence;
    } else {
      status.lost += frame.sequence - *camera.last_sequence - 1;
    }
    const double since_s = toSeconds(frame.monotonic_stamp - camera.first_stamp);
    if (since_s > kMinRateTime_s) {
      status.rate_hz = (frame.sequence - camera.first_sequence) / since_s;
    }
    status.message = problem.empty() ? "streaming " + format +
                                           (frame.has_kernel_stamp ? "" : ", without the kernel's stamps")
                                     : status.device + ": bad frame: " + problem;
  }
  camera.last_sequence = frame.sequence;
  if (problem.empty()) {
    sink->add(captured);
  }
  return problem.empty();
}

void V4l2FrameSource::readFrames(size_t index, FrameSink* sink, Timestamp now) {
  Camera& camera = *cameras_[index];
  try {
    V4l2Frame frame;
    while (camera.device->dequeue(&frame)) {
      camera.last_frame = now;
      take(index, frame, sink);
    }
  } catch (const InputError& error) {
    disconnect(&camera, error.what(), now);
  }
}

void V4l2FrameSource::run(FrameSink* sink) {
  std::vector<pollfd> waiting;
  std::vector<size_t> indices;
  Timestamp next_clock_update = monotonicNow() + kClockPeriod;
  while (true) {
    const Timestamp before = monotonicNow();
    Duration wait = maintain(before);
    if (before >= next_clock_update) {
      clock_.update();
      updateExposures();
      next_clock_update = before + kClockPeriod;
    }
    wait = std::min(wait, sink->idle());
    waiting.assign(1, {wake_.get(), POLLIN, 0});
    indices.clear();
    for (size_t i = 0; i < cameras_.size(); ++i) {
      if (cameras_[i]->device) {
        waiting.push_back({cameras_[i]->device->fileDescriptor(), POLLIN, 0});
        indices.push_back(i);
      }
    }
    if (poll(waiting.data(), waiting.size(), toPollTimeout(wait)) < 0 && errno != EINTR) {
      throw std::runtime_error("V4l2FrameSource: poll fails");
    }
    if ((waiting[0].revents & POLLIN) != 0) {
      for (const auto& camera : cameras_) {
        if (camera->device) {
          disconnect(camera.get(), "stopped", monotonicNow());
        }
      }
      return;
    }
    for (size_t i = 0; i < indices.size(); ++i) {
      const short events = waiting[i + 1].revents;
      if (events == 0) {
        continue;
      }
      Camera& camera = *cameras_[indices[i]];
      readFrames(indices[i], sink, monotonicNow());
      if (camera.device && (events & (POLLERR | POLLHUP | POLLNVAL)) != 0) {
        disconnect(&camera, camera.status.device + ": the device reports an error or is gone",
                   monotonicNow());
      }
    }
  }
}

}  // namespace vcharge
