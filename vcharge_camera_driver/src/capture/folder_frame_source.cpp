#include "vcharge_camera_driver/folder_frame_source.h"

#include <poll.h>
#include <sys/eventfd.h>

#include <algorithm>
#include <cmath>
#include <filesystem>
#include <mutex>

#include <opencv2/imgcodecs.hpp>

#include "vcharge_core/base/error.h"

namespace vcharge {

Pacer::Pacer() : wake_(eventfd(0, EFD_CLOEXEC | EFD_NONBLOCK)) {
  check(static_cast<bool>(wake_), "Pacer: no event descriptor");
}

void Pacer::stop() {
  eventfd_write(wake_.get(), 1);
}

bool Pacer::sleepUntil(Timestamp monotonic) {
  while (true) {
    const Duration left = std::max(Duration(0), monotonic - monotonicNow());
    pollfd waiting{wake_.get(), POLLIN, 0};
    const auto milliseconds = std::chrono::ceil<std::chrono::milliseconds>(left).count();
    poll(&waiting, 1, static_cast<int>(std::min<int64_t>(milliseconds, 1000)));
    if ((waiting.revents & POLLIN) != 0) {
      return false;
    }
    if (monotonicNow() >= monotonic) {
      return true;
    }
  }
}

struct FolderFrameSource::State {
  mutable std::mutex mutex;
  std::vector<CameraStatus> status;
};

FolderFrameSource::FolderFrameSource(const std::string& folder, std::vector<std::string> cameras,
                                     cv::Size size_px, double frame_rate_hz, bool loop,
                                     ClockMap::Clock drive_clock)
    : size_px_(size_px),
      frame_rate_hz_(frame_rate_hz),
      loop_(loop),
      drive_clock_(std::move(drive_clock)),
      state_(std::make_shared<State>()) {
  for (size_t i = 0; i < cameras.size(); ++i) {
    const std::filesystem::path path = std::filesystem::path(folder) / cameras[i];
    std::error_code error;
    const size_t before = files_.size();
    for (const auto& entry : std::filesystem::directory_iterator(path, error)) {
      const std::string extension = entry.path().extension().string();
      if (extension != ".png" && extension != ".jpg" && extension != ".pgm") {
        continue;
      }
      const std::string name = entry.path().stem().string();
      if (name.empty() || name.size() > 19 || name.find_first_not_of("0123456789") != std::string::npos) {
        throw InputError(entry.path().string() + ": expected a stamp in nanoseconds as the name");
      }
      files_.push_back({std::stoll(name), i, entry.path().string()});
    }
    if (files_.size() == before) {
      throw InputError(path.string() + ": expected images STAMP_NS.png, found none");
    }
    state_->status.push_back({path.string(), false, "not started yet"});
  }
  std::sort(files_.begin(), files_.end(), [](const File& a, const File& b) {
    return std::make_pair(a.stamp_ns, a.camera_index) < std::make_pair(b.stamp_ns, b.camera_index);
  });
}

std::vector<CameraStatus> FolderFrameSource::status() const {
  const std::lock_guard<std::mutex> lock(state_->mutex);
  return state_->status;
}

void FolderFrameSource::show(const File& file, Timestamp stamp, uint32_t sequence, FrameSink* sink) {
  const cv::Mat pixels = cv::imread(file.path, cv::IMREAD_GRAYSCALE);
  CameraStatus status;
  {
    const std::lock_guard<std::mutex> lock(state_->mutex);
    CameraStatus& shared = state_->status[file.camera_index];
    const bool good = pixels.size() == size_px_;
    ++(good ? shared.frames : shared.damaged);
    shared.streaming = true;
    shared.message = good ? "streaming"
                          : file.path + ": expected an image of " + std::to_string(size_px_.width) + "x" +
                                std::to_string(size_px_.height) + " pixels";
  }
  if (pixels.size() == size_px_) {
    CapturedFrame frame;
    frame.camera_index = file.camera_index;
    frame.sequence = sequence;
    frame.stamp = stamp;
    frame.image = sink->acquire(size_px_);
    pixels.copyTo(frame.image.pixels);
    sink->add(frame);
  }
}

void FolderFrameSource::run(FrameSink* sink) {
  const auto sequenceOf = [&](int64_t stamp_ns) {
    return static_cast<uint32_t>(
        std::llround(static_cast<double>(stamp_ns - files_.front().stamp_ns) * 1e-9 * frame_rate_hz_));
  };
  const Duration lap(files_.back().stamp_ns - files_.front().stamp_ns + std::llround(1e9 / frame_rate_hz_));
  Timestamp start = monotonicNow();
  const Timestamp drive_start = drive_clock_();
  const Timestamp first_start = start;
  uint32_t first_sequence = 0;
  do {
    for (const File& file : files_) {
      const Timestamp due = start + Duration(file.stamp_ns - files_.front().stamp_ns);
      while (true) {
        const Timestamp wake = std::min(due, monotonicNow() + sink->idle());
        if (!pacer_.sleepUntil(wake)) {
          return;
        }
        if (wake == due) {
          break;
        }
      }
      show(file, drive_start + (due - first_start), first_sequence + sequenceOf(file.stamp_ns), sink);
    }
    start = start + lap;
    first_sequence += sequenceOf(files_.back().stamp_ns) + 1;
  } while (loop_);
  const std::lock_guard<std::mutex> lock(state_->mutex);
  for (CameraStatus& status : state_->status) {
    status.streaming = false;
    status.message = "at the end of the images";
  }
}

}  // namespace vcharge
