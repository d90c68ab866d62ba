#include "bag_frame_source.h"

#include <algorithm>
#include <cmath>

#include "vcharge_recordings/bag_drive_source.h"

namespace vcharge {
namespace {

struct Stopped {};  // exception that ends the reading of the bag

}  // namespace

BagFrameSource::BagFrameSource(std::string bag, std::shared_ptr<const CameraRig> rig,
                               std::vector<std::string> cameras, double frame_rate_hz,
                               ClockMap::Clock drive_clock, std::function<void(const WheelTicks&)> ticks)
    : bag_(std::move(bag)),
      rig_(std::move(rig)),
      cameras_(std::move(cameras)),
      frame_rate_hz_(frame_rate_hz),
      drive_clock_(std::move(drive_clock)),
      ticks_(std::move(ticks)),
      index_of_rig_camera_(rig_->cameras.size()) {
  for (size_t i = 0; i < cameras_.size(); ++i) {
    index_of_rig_camera_[rig_->cameraIndex(cameras_[i])] = i;
    status_.push_back({bag_, false, "not begun yet"});
  }
}

std::vector<CameraStatus> BagFrameSource::status() const {
  const std::lock_guard<std::mutex> lock(mutex_);
  return status_;
}

Timestamp BagFrameSource::wait(Timestamp stamp) {
  if (!first_) {
    first_ = stamp;
    start_ = monotonicNow();
    drive_start_ = drive_clock_();
  }
  const Timestamp due = start_ + (stamp - *first_);
  while (true) {
    const Timestamp wake = std::min(due, monotonicNow() + sink_->idle());
    if (!pacer_.sleepUntil(wake)) {
      throw Stopped();
    }
    if (wake == due) {
      return drive_start_ + (stamp - *first_);
    }
  }
}

void BagFrameSource::addImage(size_t camera_index, Timestamp stamp, const Image& image) {
  CapturedFrame frame;
  frame.camera_index = index_of_rig_camera_.at(camera_index);
  frame.stamp = wait(stamp);
  frame.sequence = static_cast<uint32_t>(std::llround(toSeconds(stamp - *first_) * frame_rate_hz_));
  frame.image = sink_->acquire(image.pixels.size());
  image.pixels.copyTo(frame.image.pixels);
  {
    const std::lock_guard<std::mutex> lock(mutex_);
    CameraStatus& status = status_[frame.camera_index];
    ++status.frames;
    status.streaming = true;
    status.message = "streaming";
  }
  sink_->add(frame);
}

void BagFrameSource::addWheelTicks(const WheelTicks& ticks) {
  WheelTicks shifted = ticks;
  shifted.stamp = wait(ticks.stamp);
  ticks_(shifted);
}

void BagFrameSource::end(const std::string& message) {
  const std::lock_guard<std::mutex> lock(mutex_);
  for (CameraStatus& status : status_) {
    status.streaming = false;
    status.message = message;
  }
}

void BagFrameSource::run(FrameSink* sink) {
  sink_ = sink;
  BagDriveSourceOptions options;
  options.cameras = cameras_;
  try {
    BagDriveSource(bag_, rig_, options).run(this, [](double) {});
    end("at the end of the bag");
  } catch (const Stopped&) {
    end("stopped");
  } catch (const std::exception& error) {
    end(error.what());
  }
}

}  // namespace vcharge
