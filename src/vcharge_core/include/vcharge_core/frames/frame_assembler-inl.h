#pragma once

#include "vcharge_core/frames/frame_assembler.h"

// Definitions of FrameAssembler.
namespace vcharge {

template <class ImageType>
bool FrameAssembler<ImageType>::addImage(size_t camera_index, Timestamp stamp, ImageType image) {
  check(camera_index < is_used_.size() && is_used_[camera_index], "FrameAssembler::addImage: bad camera");
  const std::optional<Timestamp> last = newest_of_camera_[camera_index];
  if (last && toSeconds(*last - stamp) > kReplay_s) {
    startOver();
    if (on_break_) {
      on_break_(DriveBreak::kReplay, stamp);
    }
  }
  if (last_closed_ && stamp + tolerance_ <= *last_closed_) {
    ++counters_.late_images[camera_index];
    return false;
  }
  newest_image_ = newest_image_ ? std::max(*newest_image_, stamp) : stamp;
  std::optional<Timestamp>& newest = newest_of_camera_[camera_index];
  newest = newest ? std::max(*newest, stamp) : stamp;
  const auto near = frameNear(camera_index, stamp);
  const bool is_new = near == pending_.end();
  const bool waits = is_new && !isAnchor(camera_index);
  // Repeated, or older than the last frame.
  const bool is_late =
      is_new && !waits && (pending_.count(stamp) > 0 || (last_closed_ && stamp <= *last_closed_));
  if (is_late) {
    ++counters_.late_images[camera_index];
  } else if (waits) {
    earlier_[camera_index].emplace(stamp, std::move(image));
  } else {
    const auto frame = is_new ? beginFrame(stamp) : near;
    put(camera_index, stamp, std::move(image), frame);
    if (is_new) {
      joinEarlier(frame);
    }
  }
  stamps_since_[camera_index] = 0;
  handOutReady();
  return !is_late;
}

template <class ImageType>
bool FrameAssembler<ImageType>::isAnchor(size_t camera_index) const {
  if (tolerance_ == Duration(0)) {
    return true;
  }
  for (size_t camera = 0; camera < camera_index; ++camera) {
    const std::optional<Timestamp>& newest = newest_of_camera_[camera];
    if (newest && toSeconds(*newest_image_ - *newest) < kAnchorSilence_s) {
      return false;
    }
  }
  return true;
}

template <class ImageType>
typename FrameAssembler<ImageType>::PendingFrames::iterator FrameAssembler<ImageType>::frameNear(
    size_t camera_index, Timestamp stamp) {
  auto nearest = pending_.end();
  for (auto frame = pending_.lower_bound(stamp - tolerance_);
       frame != pending_.end() && frame->first <= stamp + tolerance_; ++frame) {
    if (!frame->second.has_image[camera_index] &&
        (nearest == pending_.end() ||
         std::chrono::abs(frame->first - stamp) < std::chrono::abs(nearest->first - stamp))) {
      nearest = frame;
    }
  }
  return nearest;
}

template <class ImageType>
typename FrameAssembler<ImageType>::PendingFrames::iterator FrameAssembler<ImageType>::beginFrame(
    Timestamp stamp) {
  const auto frame = pending_.try_emplace(stamp).first;
  frame->second.images.resize(is_used_.size());
  frame->second.has_image.assign(is_used_.size(), false);
  frame->second.image_offsets_s.assign(is_used_.size(), 0.0);
  frame->second.begun = clock();
  for (int& stamps : stamps_since_) {
    ++stamps;
  }
  return frame;
}

template <class ImageType>
void FrameAssembler<ImageType>::put(size_t camera_index, Timestamp stamp, ImageType image,
                                    typename PendingFrames::iterator frame) {
  Pending& pending = frame->second;
  pending.images[camera_index] = std::move(image);
  pending.has_image[camera_index] = true;
  pending.image_offsets_s[camera_index] = toSeconds(stamp - frame->first);
  ++pending.num_images;
}

template <class ImageType>
void FrameAssembler<ImageType>::joinEarlier(typename PendingFrames::iterator frame) {
  for (size_t camera = 0; camera < earlier_.size(); ++camera) {
    std::map<Timestamp, ImageType>& images = earlier_[camera];
    while (!images.empty() && images.begin()->first <= frame->first + tolerance_) {
      auto image = images.extract(images.begin());
      if (image.key() + tolerance_ < frame->first || frame->second.has_image[camera]) {
        ++counters_.late_images[camera];
      } else {
        put(camera, image.key(), std::move(image.mapped()), frame);
      }
    }
  }
}

template <class ImageType>
void FrameAssembler<ImageType>::addOdometry(const VehicleOdometry& odometry) {
  if (odometry_.isGiven()) {
    return;
  }
  std::optional<DriveBreak> found;
  if (odometry_.jumpsBack(odometry.stamp)) {
    startOver();
    found = DriveBreak::kReplay;
  }
  if (const std::optional<DriveBreak> broken = odometry_.add(odometry, &counters_)) {
    handOut(odometry.stamp);
    if (on_break_) {
      const Timestamp last_late = odometry.stamp - Duration(1);
      last_closed_ = last_closed_ ? std::max(*last_closed_, last_late) : last_late;
    }
    found = broken;
  }
  if (found && on_break_) {
    on_break_(*found, odometry.stamp);
  }
  handOutReady();
}

template <class ImageType>
void FrameAssembler<ImageType>::expect(Timestamp stamp, std::vector<bool> cameras) {
  check(cameras.size() == is_used_.size(), "FrameAssembler::expect: expected one value per camera");
  if (!last_closed_ || stamp > *last_closed_) {
    expected_[stamp] = std::move(cameras);
    handOutReady();
  }
}

template <class ImageType>
bool FrameAssembler<ImageType>::hasImages(Timestamp stamp, const Pending& pending) const {
  if (pending.num_images == num_used_ || toSeconds(clock() - pending.begun) > options_.max_camera_wait_s) {
    return true;
  }
  const auto announced = expected_.find(stamp);
  for (size_t camera = 0; camera < is_used_.size(); ++camera) {
    if (announced != expected_.end() && !announced->second[camera]) {
      continue;
    }
    const std::optional<Timestamp>& newest = newest_of_camera_[camera];
    const bool has_passed = newest && *newest > stamp + tolerance_;
    // A silent camera may resume with this frame: when waiting for everything, only newer images exclude it.
    const bool is_absent = isSilent(camera) && (!options_.waitsForEverything() || *newest_image_ > stamp);
    if (is_used_[camera] && !pending.has_image[camera] && !has_passed && !is_absent) {
      return false;
    }
  }
  return true;
}

template <class ImageType>
bool FrameAssembler<ImageType>::isReady(Timestamp stamp, const Pending& pending) const {
  return hasImages(stamp, pending) &&
         (odometry_.reaches(stamp) || toSeconds(clock() - pending.begun) > options_.max_odometry_wait_s);
}

template <class ImageType>
void FrameAssembler<ImageType>::handOutReady() {
  while (!pending_.empty() &&
         (pending_.size() > kMaxWaiting || isReady(pending_.begin()->first, pending_.begin()->second))) {
    handOutFirst();
  }
}

template <class ImageType>
void FrameAssembler<ImageType>::handOut(std::optional<Timestamp> before) {
  while (!pending_.empty() && (!before || pending_.begin()->first < *before)) {
    handOutFirst();
  }
}

template <class ImageType>
void FrameAssembler<ImageType>::handOutFirst() {
  const auto first = pending_.begin();
  Frame frame;
  frame.stamp = first->first;
  frame.images = std::move(first->second.images);
  frame.has_image = std::move(first->second.has_image);
  frame.motion.image_offsets_s = std::move(first->second.image_offsets_s);
  frame.num_resets = counters_.odometry_resets;
  const bool is_complete = first->second.num_images == num_used_;
  pending_.erase(first);
  ++counters_.frames;
  counters_.incomplete_frames += is_complete ? 0 : 1;
  for (size_t camera = 0; camera < is_used_.size(); ++camera) {
    counters_.missing_images[camera] += is_used_[camera] && !frame.has_image[camera] ? 1 : 0;
  }
  frame.corrections = takeCorrections();
  const OdometryBuffer::Lookup bridged = odometry_.lookupBridged(frame.stamp);
  frame.odometry_status = bridged.status;
  if (bridged) {
    frame.bridged_from_vehicle = bridged.odometry.odom_from_vehicle;
    frame.motion.rates = bridged.odometry.rates();
    if (const OdometryBuffer::Lookup raw = odometry_.lookup(frame.stamp)) {
      frame.odom_from_vehicle = raw.odometry.odom_from_vehicle;
      handed_out_.push_back(
          {frame.stamp, *frame.odom_from_vehicle, *frame.bridged_from_vehicle, RigidTransform()});
    }
  } else {
    ++counters_.frames_without_odometry;
  }
  last_closed_ = frame.stamp;
  expected_.erase(expected_.begin(), expected_.upper_bound(frame.stamp));
  on_frame_(std::move(frame));
}

template <class ImageType>
std::vector<CorrectedPose> FrameAssembler<ImageType>::takeCorrections() {
  std::vector<CorrectedPose> corrections;
  const auto isSame = [](const RigidTransform& a, const RigidTransform& b) {
    return a.translation() == b.translation() && a.rotation().coeffs() == b.rotation().coeffs();
  };
  if (counters_.odometry_corrections != num_corrections_) {
    for (CorrectedPose& pose : handed_out_) {
      const OdometryBuffer::Lookup raw = odometry_.lookup(pose.stamp);
      const OdometryBuffer::Lookup bridged = odometry_.lookupBridged(pose.stamp);
      if (raw && bridged && !isSame(raw.odometry.odom_from_vehicle, pose.odom_from_vehicle)) {
        pose = {pose.stamp, raw.odometry.odom_from_vehicle, bridged.odometry.odom_from_vehicle,
                pose.bridged_from_vehicle.inverse() * bridged.odometry.odom_from_vehicle};
        corrections.push_back(pose);
      }
    }
    num_corrections_ = counters_.odometry_corrections;
  }
  while (!handed_out_.empty() &&
         toSeconds(handed_out_.back().stamp - handed_out_.front().stamp) > kCorrectable_s) {
    handed_out_.pop_front();
  }
  return corrections;
}

template <class ImageType>
void FrameAssembler<ImageType>::startOver() {
  handOut(std::nullopt);
  handed_out_.clear();
  newest_image_.reset();
  last_closed_.reset();
  expected_.clear();
  std::fill(earlier_.begin(), earlier_.end(), std::map<Timestamp, ImageType>());
  std::fill(newest_of_camera_.begin(), newest_of_camera_.end(), std::nullopt);
  std::fill(stamps_since_.begin(), stamps_since_.end(), 0);
  if (!odometry_.isGiven()) {
    odometry_.clear();
  }
  ++counters_.replays;
}

template <class ImageType>
std::optional<Timestamp> FrameAssembler<ImageType>::lacksOdometryAt() const {
  if (pending_.empty() || odometry_.reaches(pending_.begin()->first) ||
      toSeconds(clock() - pending_.begin()->second.begun) <= options_.max_odometry_gap_s) {
    return std::nullopt;
  }
  return pending_.begin()->first;
}

}  // namespace vcharge
