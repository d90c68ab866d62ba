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

/// State of a drive's topics for /diagnostics: which topic is silent, which had bad data and why, where
/// stamps jumped back. A topic has recovered once good data comes. Callers pass the time of a steady clock.
/// Thread safe: reports are made while data is processed.
class DriveMonitor {
 public:
  using SteadyTime = std::chrono::steady_clock::time_point;
  enum class Level { kOk = 0, kWarn = 1, kError = 2 };
  struct Report {
    Level level = Level::kOk;
    std::string message;                                      ///< one line with the worst fault first
    std::vector<std::pair<std::string, std::string>> values;  ///< per topic: counts, rate, last error
  };
  enum class Change { kNone, kFailed, kRecovered };

  DriveMonitor(double max_silence_s, SteadyTime now);

  /// Declares a topic that must have data; silence of other topics is not a fault.
  void expectTopic(const std::string& topic);
  /// Records good data. A stamp before the topic's newest counts as a jump back, which is reported for some
  /// seconds, at least in the next report. Returns kRecovered if the topic was in fault.
  Change addGood(const std::string& topic, std::optional<Timestamp> stamp, SteadyTime now);
  /// Records bad data and its reason. Returns kFailed if the text is new for this topic and should be logged.
  Change addBad(const std::string& topic, const std::string& error, SteadyTime now);

  /// No topic is read between beginWork() and endWork(), so that time does not count as silence.
  void beginWork(SteadyTime now);
  void endWork(SteadyTime now);

  /// The state at `now`. An error is kept until it was reported once and good data followed.
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
  std::mutex mutex_;  // guards all members below
  SteadyTime start_;
  std::optional<SteadyTime> work_began_;
  SteadyTime last_report_;
  std::map<std::string, Topic> topics_;
};

}  // namespace vcharge
