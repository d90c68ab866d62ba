#include "liveness/camera_liveness.h"

#include <algorithm>

namespace vcharge {
namespace {

// Path on which the pixels of a working camera change.
constexpr double kMoved_m = 0.02;
constexpr size_t kMaxWaiting = 100;
constexpr size_t kMaxJudged = 100;
constexpr size_t kMaxGaps = 100;

const Duration kSilent = durationFromSeconds(kSilent_s);

}  // namespace

void CameraLiveness::addImage(Timestamp stamp, uint64_t fingerprint) {
  const bool is_old = (!waiting_.empty() && stamp <= waiting_.back().stamp) ||
                      (!judged_.empty() && stamp <= judged_.back().stamp);
  if (is_old) {
    return;
  }
  waiting_.push_back({stamp, fingerprint});
  if (waiting_.size() > kMaxWaiting) {
    waiting_.pop_front();
  }
}

void CameraLiveness::settle(Timestamp until, const PoseAt& fixed_from_vehicle_at) {
  for (; !waiting_.empty() && waiting_.front().stamp <= until; waiting_.pop_front()) {
    const Image& image = waiting_.front();
    const std::optional<RigidTransform> pose = fixed_from_vehicle_at(image.stamp);
    const bool is_equal = last_fingerprint_ == image.fingerprint;
    bool is_repeated = false;
    if (!is_equal) {
      last_new_pose_ = pose;
    } else if (pose && last_new_pose_) {
      is_repeated = (pose->translation() - last_new_pose_->translation()).norm() > kMoved_m;
    } else {
      is_repeated = !judged_.empty() && judged_.back().is_repeated;
      last_new_pose_ = pose;
    }
    last_fingerprint_ = image.fingerprint;
    judged_.push_back({image.stamp, is_repeated});
    if (judged_.size() > kMaxJudged) {
      judged_.pop_front();
    }
    if (!is_repeated) {
      noteNew(image.stamp);
    }
  }
}

void CameraLiveness::noteNew(Timestamp stamp) {
  if (last_new_ && stamp - *last_new_ > kSilent) {
    gaps_.push_back({*last_new_, stamp});
    if (gaps_.size() > kMaxGaps) {
      gaps_.pop_front();
    }
  }
  last_new_ = last_new_ ? std::max(*last_new_, stamp) : stamp;
}

void CameraLiveness::addRangeMap(Timestamp stamp) {
  last_range_map_ = stamp;
  if (!last_new_ || isRepeated(stamp)) {
    return;
  }
  if (stamp > *last_new_) {
    noteNew(stamp);
    return;
  }
  for (auto gap = gaps_.begin(); gap != gaps_.end(); ++gap) {
    if (gap->from < stamp && stamp < gap->to) {
      const Gap after{stamp, gap->to};
      gap->to = stamp;
      gaps_.insert(gap + 1, after);
      break;
    }
  }
}

CameraLiveness::State CameraLiveness::stateAt(Timestamp stamp) const {
  if (!last_new_) {
    return State::kUnknown;
  }
  if (!wasSilent(stamp - Duration(1), stamp)) {
    return State::kAlive;
  }
  return isRepeated(stamp) ? State::kFrozen : State::kSilent;
}

bool CameraLiveness::wasSilent(Timestamp from, Timestamp to) const {
  if (!last_new_) {
    return false;
  }
  // Silence begins kSilent_s after an image and ends before the next one.
  const auto overlaps = [&](Timestamp last, std::optional<Timestamp> next) {
    const Timestamp first_silent = std::max(last + kSilent, from + Duration(1));
    return first_silent <= to && (!next || first_silent < *next);
  };
  return overlaps(*last_new_, std::nullopt) ||
         std::any_of(gaps_.begin(), gaps_.end(), [&](const Gap& gap) { return overlaps(gap.from, gap.to); });
}

bool CameraLiveness::isAlive(Timestamp from, Timestamp to) const {
  return last_new_ ? !wasSilent(from, to) : last_range_map_ && to - *last_range_map_ < kSilent;
}

bool CameraLiveness::isRepeated(Timestamp stamp) const {
  const auto after = std::find_if(judged_.begin(), judged_.end(),
                                  [&](const Judged& judged) { return judged.stamp > stamp; });
  return after != judged_.begin() && (after - 1)->is_repeated && stamp - (after - 1)->stamp < kSilent;
}

}  // namespace vcharge
