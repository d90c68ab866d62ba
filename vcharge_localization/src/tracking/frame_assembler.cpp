#include "vcharge_localization/frame_assembler.h"

#include <utility>

#include "vcharge_core/base/error.h"

namespace vcharge {
namespace {

constexpr double kReplay_s = 1.0;
/// Whatever is missing, no more frames than these wait.
constexpr size_t kMaxPending = 25;

}  // namespace

void FrameAssemblerOptions::validate() const {
  requireField(silent_after_frames >= 1, "silent_after_frames", "must be 1 or more", silent_after_frames);
  requireField(max_odometry_wait_s >= 0.0, "max_odometry_wait_s", "must not be negative",
               max_odometry_wait_s);
  requireField(max_speed_m_per_s > 0.0, "max_speed_m_per_s", "must be positive", max_speed_m_per_s);
  validateInner("odometry", odometry);
}

FrameAssembler::FrameAssembler(size_t num_cameras, const FrameAssemblerOptions& options,
                               FrameCallback on_frame)
    : num_cameras_(num_cameras),
      options_(options),
      on_frame_(std::move(on_frame)),
      odometry_(options.odometry),
      missed_(num_cameras, 0) {
  options_.validate();
  check(num_cameras > 0, "FrameAssembler: expected cameras");
}

bool FrameAssembler::isSilent(size_t camera_index) const {
  return missed_[camera_index] >= options_.silent_after_frames;
}

void FrameAssembler::addOdometry(const VehicleOdometry& odometry) {
  if (last_odometry_ && odometry.stamp > last_odometry_->stamp) {
    const RigidTransform motion = last_odometry_->odom_from_vehicle.inverse() * odometry.odom_from_vehicle;
    const double period_s = toSeconds(odometry.stamp - last_odometry_->stamp);
    if (motion.translation().norm() > options_.max_speed_m_per_s * period_s + 0.1) {
      // Nothing before is comparable: interpolation must not cross the jump.
      odometry_ = OdometryBuffer(options_.odometry);
      ++counts_.odometry_resets;
    }
  }
  last_odometry_ = odometry;
  odometry_.add(odometry);
  handOut(false);
}

void FrameAssembler::addImage(size_t camera_index, Timestamp stamp, const Image& image) {
  check(camera_index < num_cameras_, "FrameAssembler::addImage: bad camera");
  if (newest_image_ && toSeconds(*newest_image_ - stamp) > kReplay_s) {
    pending_.clear();
    last_frame_.reset();
    newest_image_.reset();
  }
  if (last_frame_ && stamp <= *last_frame_) {
    ++counts_.late_images;
    return;
  }
  newest_image_ = newest_image_ && *newest_image_ > stamp ? *newest_image_ : stamp;
  missed_[camera_index] = 0;
  Pending& pending = pending_[stamp];
  pending.images.resize(num_cameras_);
  if (pending.images[camera_index].pixels.empty()) {
    pending.images[camera_index] = image;
    ++pending.num_present;
  }
  handOut(false);
}

bool FrameAssembler::hasAllImages(Timestamp stamp, const Pending& pending) const {
  if (pending.num_present == num_cameras_) {
    return true;
  }
  // A later frame that is complete, or two later ones, overtake this one.
  size_t num_later = 0;
  for (auto later = pending_.upper_bound(stamp); later != pending_.end(); ++later, ++num_later) {
    if (later->second.num_present == num_cameras_) {
      return true;
    }
  }
  if (num_later >= 2) {
    return true;
  }
  for (size_t camera = 0; camera < num_cameras_; ++camera) {
    if (pending.images[camera].pixels.empty() && !isSilent(camera)) {
      return false;
    }
  }
  return true;
}

bool FrameAssembler::hasOdometry(Timestamp stamp) const {
  const std::optional<Timestamp> newest = odometry_.newestStamp();
  return newest && *newest >= stamp;
}

void FrameAssembler::handOut(bool all) {
  while (!pending_.empty()) {
    const auto first = pending_.begin();
    const bool is_ready = hasAllImages(first->first, first->second) &&
                          (hasOdometry(first->first) ||
                           toSeconds(*newest_image_ - first->first) > options_.max_odometry_wait_s);
    if (!all && !is_ready && pending_.size() < kMaxPending) {
      return;
    }
    const Timestamp stamp = first->first;
    Pending pending = std::move(first->second);
    pending_.erase(first);
    emit(stamp, std::move(pending));
  }
}

void FrameAssembler::emit(Timestamp stamp, Pending pending) {
  for (size_t camera = 0; camera < num_cameras_; ++camera) {
    missed_[camera] = pending.images[camera].pixels.empty() ? missed_[camera] + 1 : 0;
  }
  ++counts_.frames;
  counts_.incomplete_frames += pending.num_present < num_cameras_ ? 1 : 0;
  LocalizationFrame frame;
  frame.stamp = stamp;
  frame.images = std::move(pending.images);
  frame.num_resets = counts_.odometry_resets;
  if (const OdometryBuffer::Lookup lookup = odometry_.lookup(stamp)) {
    frame.odom_from_vehicle = lookup.odometry.odom_from_vehicle;
  } else {
    ++counts_.frames_without_odometry;
  }
  last_frame_ = stamp;
  on_frame_(std::move(frame));
}

void FrameAssembler::finish() {
  handOut(true);
}

}  // namespace vcharge
