#include "check/stamp_check.h"

#include <algorithm>
#include <cmath>

namespace vcharge::internal {
namespace {

constexpr double kManyLost = 0.005;
constexpr double kTooManyLost = 0.25;
/// Bounds of the span from the 5 % to the 95 % quantile of the delays from stamp to recording.
constexpr double kUnevenDelay_s = 0.5;
/// A stamp that is this much later than its recording is from another clock.
constexpr double kFuture_s = 0.05;
constexpr double kManyDisordered = 0.0;
constexpr double kTooManyDisordered = 0.3;
constexpr double kManyIncomplete = 0.01;
constexpr double kTooManyIncomplete = 0.7;

/// Median distance, in seconds, from each stamp to the nearest of `others` (sorted, not empty).
double medianSkew(const std::vector<Timestamp>& stamps, const std::vector<Timestamp>& others) {
  std::vector<double> skews;
  for (const Timestamp stamp : stamps) {
    auto next = std::lower_bound(others.begin(), others.end(), stamp);
    double skew = next == others.end() ? toSeconds(others.back() - stamp) : toSeconds(*next - stamp);
    if (next != others.begin()) {
      const double before = toSeconds(*(next - 1) - stamp);
      skew = std::abs(before) < std::abs(skew) ? before : skew;
    }
    skews.push_back(std::abs(skew));
  }
  return quantile(skews, 0.5);
}

}  // namespace

void TopicTimes::add(Timestamp stamp, Timestamp recorded) {
  if (stamp == Timestamp()) {
    ++num_unstamped_;
    return;
  }
  if (!stamps_.empty()) {
    num_backwards_ += stamp < stamps_.back() ? 1 : 0;
    num_repeated_ += stamp == stamps_.back() ? 1 : 0;
  }
  stamps_.push_back(stamp);
  delays_s_.push_back(toSeconds(recorded - stamp));
}

std::vector<Timestamp> TopicTimes::sortedStamps() const {
  std::vector<Timestamp> sorted = stamps_;
  std::sort(sorted.begin(), sorted.end());
  sorted.erase(std::unique(sorted.begin(), sorted.end()), sorted.end());
  return sorted;
}

double TopicTimes::period_s() const {
  const std::vector<Timestamp> sorted = sortedStamps();
  std::vector<double> steps;
  for (size_t i = 1; i < sorted.size(); ++i) {
    steps.push_back(toSeconds(sorted[i] - sorted[i - 1]));
  }
  return steps.empty() ? 0.0 : quantile(steps, 0.5);
}

void TopicTimes::judgeOrder(const std::string& subject, CheckFindings* findings) const {
  const int64_t num_bad = num_backwards_ + num_repeated_ + num_unstamped_;
  findings->atMost(subject + ": stamp order",
                   fractionOf(num_bad, static_cast<int64_t>(stamps_.size()) + num_unstamped_),
                   kManyDisordered, kTooManyDisordered,
                   std::to_string(num_backwards_) + " stamps go back, " + std::to_string(num_repeated_) +
                       " repeat, " + std::to_string(num_unstamped_) + " are missing",
                   "two publishers on one topic, or a clock that was set?");
  if (delays_s_.empty()) {
    return;
  }
  const double earliest = quantile(delays_s_, 0.05), latest = quantile(delays_s_, 0.95);
  const std::string figure = "recorded " + toText(1e3 * quantile(delays_s_, 0.5), 1) +
                             " ms after the stamp (5 to 95 %: " + toText(1e3 * earliest, 1) + " to " +
                             toText(1e3 * latest, 1) + " ms)";
  if (earliest < -kFuture_s) {
    findings->add(subject + ": clock", CheckGrade::kWarn,
                  figure + ": stamps of another clock than the recorder's?");
  } else {
    findings->atMost(subject + ": clock", latest - earliest, kUnevenDelay_s, 1e9, figure,
                     "a busy recorder, or stamps of another clock?");
  }
}

void TopicTimes::judgeRate(const std::string& subject, double max_gap_s, CheckFindings* findings) const {
  const std::vector<Timestamp> sorted = sortedStamps();
  const double period = period_s();
  if (period <= 0.0) {
    findings->add(subject + ": rate", CheckGrade::kFail, "fewer than two messages with stamps of their own");
    return;
  }
  int64_t num_lost = 0;
  double longest = 0.0;
  for (size_t i = 1; i < sorted.size(); ++i) {
    const double gap = toSeconds(sorted[i] - sorted[i - 1]);
    longest = std::max(longest, gap);
    num_lost += std::max<int64_t>(0, std::llround(gap / period) - 1);
  }
  const double lost = fractionOf(num_lost, static_cast<int64_t>(sorted.size()) + num_lost);
  const std::string figure = toText(1.0 / period, 2) + " Hz, " + std::to_string(num_lost) + " of " +
                             std::to_string(sorted.size() + num_lost) + " lost, longest gap " +
                             toText(longest, 2) + " s";
  if (longest > max_gap_s) {
    findings->add(subject + ": rate", CheckGrade::kFail,
                  figure + ": expected none above " + toText(max_gap_s, 2) + " s");
  } else {
    findings->atMost(subject + ": rate", lost, kManyLost, kTooManyLost, figure,
                     "a slow disk, a loose plug, or too little bandwidth?");
  }
}

void judgeSync(const std::vector<std::vector<Timestamp>>& stamps_by_camera, double period_s,
               double tolerance_s, CheckFindings* findings) {
  // Only in the time in which all cameras run; silent cameras have a finding of their own.
  std::vector<const std::vector<Timestamp>*> cameras;
  for (const std::vector<Timestamp>& stamps : stamps_by_camera) {
    if (!stamps.empty()) {
      cameras.push_back(&stamps);
    }
  }
  if (cameras.size() < 2) {
    return;
  }
  Timestamp begin = cameras.front()->front(), end = cameras.front()->back();
  for (const auto* stamps : cameras) {
    begin = std::max(begin, stamps->front());
    end = std::min(end, stamps->back());
  }
  const Duration tolerance = durationFromSeconds(tolerance_s);
  std::vector<Timestamp> instants = *cameras.front();
  for (const auto* stamps : cameras) {
    if (tolerance_s == 0.0) {
      instants.insert(instants.end(), stamps->begin(), stamps->end());
    }
  }
  std::sort(instants.begin(), instants.end());
  instants.erase(std::unique(instants.begin(), instants.end()), instants.end());
  int64_t num_incomplete = 0, num_instants = 0;
  for (const Timestamp stamp : instants) {
    if (begin <= stamp && stamp <= end) {
      ++num_instants;
      num_incomplete += std::all_of(cameras.begin(), cameras.end(),
                                    [&](const auto* stamps) {
                                      const auto next =
                                          std::lower_bound(stamps->begin(), stamps->end(), stamp - tolerance);
                                      return next != stamps->end() && *next <= stamp + tolerance;
                                    })
                            ? 0
                            : 1;
    }
  }
  if (num_instants == 0) {
    findings->add("sync", CheckGrade::kFail, "the cameras never run at the same time");
    return;
  }
  double skew = 0.0;
  for (const auto* stamps : cameras) {
    skew = std::max(skew, medianSkew(*cameras.front(), *stamps));
  }
  const std::string figure = "all " + std::to_string(cameras.size()) + " cameras at " +
                             percentText(1.0 - fractionOf(num_incomplete, num_instants)) + " of " +
                             std::to_string(num_instants) + " instants";
  if (skew > tolerance_s) {
    findings->add(
        "sync", CheckGrade::kFail,
        figure + ", usual stamps " + toText(1e3 * skew, 2) + " ms apart" +
            (skew < 0.5 * period_s ? "" : " (more than half a period)") +
            ": images of one trigger pulse need one stamp; cameras without one need stamp_tolerance_s in "
            "rig.yaml");
    return;
  }
  findings->atMost("sync", fractionOf(num_incomplete, num_instants), kManyIncomplete, kTooManyIncomplete,
                   figure, "a camera that loses images, or stamps that differ");
}

}  // namespace vcharge::internal
