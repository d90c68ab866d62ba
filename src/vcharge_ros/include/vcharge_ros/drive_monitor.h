#pragma once

#include <chrono>
#include <cstdint>
#include <map>
#include <mutex>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "vcharge_core/base/timestamp.h"

namespace vcharge {

/// What arrives on a drive's topics, judged for /diagnostics: which topic is silent, which brought something
/// bad and why, where time jumped back. A topic is well again once it brings good data. Knows no clock:
/// callers pass a steady one. Thread safe: /diagnostics go on while data is processed.
class DriveMonitor {
 public:
  using SteadyTime = std::chrono::steady_clock::time_point;
  enum class Level { kOk = 0, kWarn = 1, kError = 2 };
  struct Report {
    Level level = Level::kOk;
    std::string message;                                      ///< one line, the worst first
    std::vector<std::pair<std::string, std::string>> values;  ///< per topic: counts, rate, last error
  };
  enum class Change { kNone, kFailed, kRecovered };

  DriveMonitor(double max_silence_s, SteadyTime now);

  /// A topic that must bring data; silence on others is no fault.
  void expectTopic(const std::string& topic);
  /// Good data. A stamp (if it has one) before the topic's newest is counted as a jump back and reported for
  /// some seconds, and once however late the next report is. kRecovered when the topic was in fault.
  Change addGood(const std::string& topic, std::optional<Timestamp> stamp, SteadyTime now);
  /// Bad data, and why. kFailed when the text is news for this topic: worth one line in the log.
  Change addBad(const std::string& topic, const std::string& error, SteadyTime now);

  /// Nothing is taken from any topic from beginWork() to endWork(): that time counts as nobody's silence.
  void beginWork(SteadyTime now);
  void endWork(SteadyTime now);

  /// The state now. An error stays until it was reported once and good data came after it.
  Report report(SteadyTime now);

 private:
  struct Topic {
    bool expected = false;
    uint64_t good = 0;
    uint64_t bad = 0;
    uint64_t jumps_back = 0;
    std::optional<Timestamp> newest;
    SteadyTime last_good;
    SteadyTime last_jump;
    std::string jump_text;
    bool jump_unreported = false;
    bool failing = false;
    bool unreported = false;
    std::string error;
    uint64_t good_at_last_report = 0;
  };

  const double max_silence_s_;
  std::mutex mutex_;  // guards all below
  SteadyTime start_;
  std::optional<SteadyTime> work_began_;
  SteadyTime last_report_;
  std::map<std::string, Topic> topics_;
};

}  // namespace vcharge
