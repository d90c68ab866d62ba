#include "vcharge_camera_driver/trigger_grouper.h"

#include <algorithm>
#include <cmath>

#include "vcharge_core/base/error.h"
#include "vcharge_core/base/options.h"

namespace vcharge {
namespace {

constexpr double kToleranceInPeriods = 0.5;
// Over more pulses, a small deviation from the nominal rate could cause a miscount.
constexpr int64_t kMaxPulsesBetweenFrames = 100;
// Pulses whose frames may still arrive; the spread of older ones is final.
constexpr size_t kMaxOpenPulses = 16;

MultiFrameSynchronizerOptions synchronizerOptions(const TriggerGrouperOptions& options) {
  options.validate();
  MultiFrameSynchronizerOptions result;
  result.tolerance_s = kToleranceInPeriods / options.frame_rate_hz;
  result.keep_incomplete = true;
  return result;
}

}  // namespace

TriggerGrouper::TriggerGrouper(size_t num_cameras, const TriggerGrouperOptions& options)
    : options_(options),
      tolerance_(durationFromSeconds(kToleranceInPeriods / options.frame_rate_hz)),
      synchronizer_(num_cameras, synchronizerOptions(options)),
      cameras_(num_cameras) {}

bool TriggerGrouper::align(const CapturedFrame& frame) {
  Camera& camera = cameras_[frame.camera_index];
  ++camera.counts.frames;
  if (camera.sequence) {
    // The difference of unsigned numbers is correct across their wrap-around.
    const auto by_number = static_cast<int64_t>(frame.sequence - *camera.sequence);
    const auto by_stamp =
        static_cast<int64_t>(std::llround(toSeconds(frame.stamp - camera.stamp) * options_.frame_rate_hz));
    if (by_number == by_stamp && by_number >= 1 && by_number <= kMaxPulsesBetweenFrames) {
      ++camera.consistent;
      camera.counts.lost += static_cast<uint64_t>(by_number - 1);
    } else {
      camera.consistent = 0;
      ++camera.counts.slips;
    }
  }
  camera.sequence = frame.sequence;
  camera.stamp = frame.stamp;
  camera.counts.aligned = camera.consistent >= options_.realign_frames;
  camera.counts.unaligned += camera.counts.aligned ? 0 : 1;
  return camera.counts.aligned;
}

void TriggerGrouper::takeGroups(Groups groups, Groups* ready) {
  for (std::shared_ptr<const MultiFrame>& group : groups) {
    for (size_t i = 0; i < cameras_.size(); ++i) {
      cameras_[i].counts.missing += group->images[i].pixels.empty() ? 1 : 0;
    }
    ready->push_back(std::move(group));
  }
}

TriggerGrouper::Groups TriggerGrouper::add(const CapturedFrame& frame, Timestamp now) {
  check(frame.camera_index < cameras_.size(), "TriggerGrouper::add: camera index out of range");
  Groups ready = expire(now);
  if (!align(frame)) {
    return ready;
  }
  const auto span = std::find_if(spans_.begin(), spans_.end(), [&](const StampSpan& each) {
    return std::chrono::abs(each.earliest - frame.stamp) <= tolerance_;
  });
  if (span == spans_.end()) {
    spans_.push_back({frame.stamp, frame.stamp});
    if (spans_.size() > kMaxOpenPulses) {
      const double spread_s = toSeconds(spans_.front().latest - spans_.front().earliest);
      max_spread_s_ = std::max(max_spread_s_, spread_s);
      sum_spread_s_ += spread_s;
      ++num_spreads_;
      spans_.pop_front();
    }
  } else {
    span->earliest = std::min(span->earliest, frame.stamp);
    span->latest = std::max(span->latest, frame.stamp);
  }
  arrivals_.push_back({now, frame.stamp});
  const std::shared_ptr<const MultiFrame> complete =
      synchronizer_.add(frame.camera_index, frame.stamp, frame.image);
  takeGroups(synchronizer_.takeIncomplete(), &ready);
  if (complete) {
    const Timestamp done = complete->stamp + tolerance_;
    arrivals_.erase(std::remove_if(arrivals_.begin(), arrivals_.end(),
                                   [&](const Arrival& arrival) { return arrival.stamp <= done; }),
                    arrivals_.end());
    ready.push_back(complete);
  }
  return ready;
}

TriggerGrouper::Groups TriggerGrouper::expire(Timestamp now) {
  Groups ready;
  while (!arrivals_.empty() && arrivals_.front().time + tolerance_ <= now) {
    synchronizer_.giveUpUntil(arrivals_.front().stamp);
    arrivals_.pop_front();
  }
  takeGroups(synchronizer_.takeIncomplete(), &ready);
  return ready;
}

std::optional<Timestamp> TriggerGrouper::nextDeadline() const {
  if (arrivals_.empty()) {
    return std::nullopt;
  }
  return arrivals_.front().time + tolerance_;
}

TriggerGrouperCounts TriggerGrouper::counts() const {
  TriggerGrouperCounts counts;
  counts.complete = synchronizer_.counts().complete_sets;
  counts.incomplete = synchronizer_.counts().incomplete_sets;
  counts.late = synchronizer_.counts().late_images;
  counts.max_spread_s = max_spread_s_;
  counts.mean_spread_s = num_spreads_ == 0 ? 0.0 : sum_spread_s_ / static_cast<double>(num_spreads_);
  for (const Camera& camera : cameras_) {
    counts.cameras.push_back(camera.counts);
  }
  return counts;
}

}  // namespace vcharge
