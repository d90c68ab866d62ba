#include "vcharge_ros/drive_monitor.h"

#include <cstdio>

namespace vcharge {
namespace {

constexpr double kJumpReportTime_s = 5.0;

double secondsBetween(DriveMonitor::SteadyTime from, DriveMonitor::SteadyTime to) {
  return std::chrono::duration<double>(to - from).count();
}

std::string tenths(double value, const char* unit) {
  char text[48];
  std::snprintf(text, sizeof(text), "%.1f %s", value, unit);
  return text;
}

void append(const std::string& text, std::string* list) {
  *list += (list->empty() ? "" : "; ") + text;
}

}  // namespace

DriveMonitor::DriveMonitor(double max_silence_s, SteadyTime now)
    : max_silence_s_(max_silence_s), start_(now), last_report_(now) {}

void DriveMonitor::expectTopic(const std::string& topic) {
  const std::lock_guard<std::mutex> lock(mutex_);
  topics_[topic].expected = true;
}

DriveMonitor::Change DriveMonitor::addGood(const std::string& topic_name, std::optional<Timestamp> stamp,
                                           SteadyTime now) {
  const std::lock_guard<std::mutex> lock(mutex_);
  Topic& topic = topics_[topic_name];
  if (stamp && topic.newest && *stamp < *topic.newest) {
    ++topic.jumps_back;
    topic.last_jump = now;
    topic.jump_unreported = true;
    topic.jump_text = "stamp " + toString(*stamp) + " jumped back by " +
                      tenths(toSeconds(*topic.newest - *stamp), "s") + ", expected increasing stamps";
  }
  ++topic.good;
  topic.newest = stamp;
  topic.last_good = now;
  const bool recovered = topic.failing;
  topic.failing = false;
  return recovered ? Change::kRecovered : Change::kNone;
}

DriveMonitor::Change DriveMonitor::addBad(const std::string& topic_name, const std::string& error,
                                          SteadyTime now) {
  const std::lock_guard<std::mutex> lock(mutex_);
  Topic& topic = topics_[topic_name];
  const bool news = !topic.failing || topic.error != error;
  ++topic.bad;
  topic.failing = true;
  topic.unreported = true;
  topic.error = error;
  if (topic.good == 0) {
    topic.last_good = now;  // the topic sends data, so it is not silent
  }
  return news ? Change::kFailed : Change::kNone;
}

void DriveMonitor::beginWork(SteadyTime now) {
  const std::lock_guard<std::mutex> lock(mutex_);
  work_began_ = now;
}

void DriveMonitor::endWork(SteadyTime now) {
  const std::lock_guard<std::mutex> lock(mutex_);
  if (!work_began_) {
    return;
  }
  const SteadyTime::duration deaf = now - *work_began_;
  work_began_.reset();
  start_ += deaf;
  for (auto& [name, topic] : topics_) {
    topic.last_good += deaf;
  }
}

DriveMonitor::Report DriveMonitor::report(SteadyTime now) {
  const std::lock_guard<std::mutex> lock(mutex_);
  Report result;
  std::string errors, warnings;
  const double period_s = secondsBetween(last_report_, now);
  for (auto& [name, topic] : topics_) {
    const double silence_s =
        secondsBetween(topic.good + topic.bad > 0 ? topic.last_good : start_, work_began_.value_or(now));
    if (topic.failing || topic.unreported) {
      append(topic.error, &errors);
      topic.unreported = false;
    } else if (topic.expected && silence_s > max_silence_s_) {
      append(name + ": no data for " + tenths(silence_s, "s") + ", expected some at least every " +
                 tenths(max_silence_s_, "s"),
             &errors);
    }
    const bool jumped_lately =
        topic.jumps_back > 0 && secondsBetween(topic.last_jump, now) < kJumpReportTime_s;
    if (topic.jump_unreported || jumped_lately) {
      topic.jump_unreported = false;
      append(name + ": " + topic.jump_text, &warnings);
    }
    std::string value = std::to_string(topic.good) + " good, " + std::to_string(topic.bad) + " bad, " +
                        std::to_string(topic.jumps_back) + " jumps back";
    if (period_s > 0.0) {
      value += ", " + tenths(static_cast<double>(topic.good - topic.good_at_last_report) / period_s, "Hz");
    }
    topic.good_at_last_report = topic.good;
    result.values.emplace_back(name, value);
    if (topic.bad > 0) {
      result.values.emplace_back(name + " last error", topic.error);
    }
  }
  last_report_ = now;
  result.level = !errors.empty() ? Level::kError : !warnings.empty() ? Level::kWarn : Level::kOk;
  result.message = errors;
  if (!warnings.empty()) {
    append(warnings, &result.message);
  }
  if (result.message.empty()) {
    result.message = "data on all topics";
  }
  return result;
}

}  // namespace vcharge
