#include "vcharge_core/frames/multi_frame_synchronizer.h"

#include <algorithm>
#include <utility>

#include "vcharge_core/base/error.h"

namespace vcharge {
namespace {

/// A larger step back of stamps is a replay.
constexpr double kReplay_s = 1.0;
/// Incomplete sets that are kept.
constexpr size_t kMaxPendingSets = 8;

}  // namespace

MultiFrameSynchronizer::MultiFrameSynchronizer(size_t num_cameras,
                                               const MultiFrameSynchronizerOptions& options)
    : num_cameras_(num_cameras), options_(options), tolerance_(durationFromSeconds(options.tolerance_s)) {
  check(num_cameras > 0, "MultiFrameSynchronizer: needs at least one camera");
  options_.validate();
  counts_.missing_per_camera.assign(num_cameras, 0);
}

void MultiFrameSynchronizer::giveUpOldest() {
  PendingSet& oldest = pending_.front();
  ++counts_.incomplete_sets;
  for (size_t i = 0; i < num_cameras_; ++i) {
    if (!oldest.present[i]) {
      ++counts_.missing_per_camera[i];
    }
  }
  last_closed_ = oldest.frame.stamp;
  if (options_.keep_incomplete) {
    incomplete_.push_back(std::make_shared<const MultiFrame>(std::move(oldest.frame)));
  }
  pending_.pop_front();
}

void MultiFrameSynchronizer::giveUpUntil(Timestamp stamp) {
  while (!pending_.empty() && pending_.front().frame.stamp <= stamp) {
    giveUpOldest();
  }
}

std::vector<std::shared_ptr<const MultiFrame>> MultiFrameSynchronizer::takeIncomplete() {
  return std::exchange(incomplete_, {});
}

std::shared_ptr<const MultiFrame> MultiFrameSynchronizer::add(size_t camera_index, Timestamp stamp,
                                                              const Image& image) {
  check(camera_index < num_cameras_, "MultiFrameSynchronizer::add: camera index out of range");
  if (newest_ && toSeconds(*newest_ - stamp) >= kReplay_s) {
    while (!pending_.empty()) {
      giveUpOldest();
    }
    last_closed_.reset();
    newest_.reset();
    ++counts_.resets;
  }
  newest_ = newest_ ? std::max(*newest_, stamp) : stamp;
  if (last_closed_ && stamp <= *last_closed_ + tolerance_) {
    ++counts_.late_images;
    return nullptr;
  }

  // The pending set nearest in time, or a new one. The distance is that to the farthest image of the set, so
  // that no set spans more than the tolerance.
  const auto distance = [&](const PendingSet& set) {
    return std::max(std::chrono::abs(set.frame.stamp - stamp), std::chrono::abs(set.latest - stamp));
  };
  auto set = std::min_element(
      pending_.begin(), pending_.end(),
      [&](const PendingSet& left, const PendingSet& right) { return distance(left) < distance(right); });
  if (set == pending_.end() || distance(*set) > tolerance_) {
    const auto position = std::find_if(pending_.begin(), pending_.end(),
                                       [&](const PendingSet& other) { return stamp < other.frame.stamp; });
    set = pending_.insert(position, PendingSet());
    set->frame.stamp = stamp;
    set->latest = stamp;
    set->frame.images.resize(num_cameras_);
    set->present.assign(num_cameras_, false);
  }
  if (set->present[camera_index]) {
    ++counts_.duplicate_images;
    return nullptr;
  }
  set->present[camera_index] = true;
  set->frame.images[camera_index] = image;
  set->frame.stamp = std::min(set->frame.stamp, stamp);
  set->latest = std::max(set->latest, stamp);
  ++set->num_present;

  if (set->num_present == num_cameras_) {
    auto complete = std::make_shared<MultiFrame>(std::move(set->frame));
    const auto num_overtaken = set - pending_.begin();
    set->frame.stamp = complete->stamp;
    for (auto i = 0; i < num_overtaken; ++i) {
      giveUpOldest();
    }
    pending_.pop_front();
    last_closed_ = complete->stamp;
    ++counts_.complete_sets;
    return complete;
  }
  if (pending_.size() > kMaxPendingSets) {
    giveUpOldest();
  }
  return nullptr;
}

}  // namespace vcharge
