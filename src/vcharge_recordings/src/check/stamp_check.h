#pragma once

#include <cstdint>
#include <string>
#include <vector>

#include "check/check_findings.h"
#include "vcharge_core/base/timestamp.h"

namespace vcharge::internal {

/// The times of one topic's messages.
class TopicTimes {
 public:
  void add(Timestamp stamp, Timestamp recorded);

  bool empty() const { return stamps_.empty(); }
  /// Stamps in increasing order, without repetitions.
  std::vector<Timestamp> sortedStamps() const;
  /// Median distance of neighbouring stamps; 0 for fewer than two.
  double period_s() const;
  /// Checks the order of stamps, and their delays to the times of recording.
  void judgeOrder(const std::string& subject, CheckFindings* findings) const;
  /// Checks the rate, lost messages and the longest gap. A gap above `max_gap_s` fails.
  void judgeRate(const std::string& subject, double max_gap_s, CheckFindings* findings) const;

 private:
  std::vector<Timestamp> stamps_;  // in the order of recording
  std::vector<double> delays_s_;   // from stamp to recording
  int64_t num_backwards_ = 0, num_repeated_ = 0, num_unstamped_ = 0;
};

/// Checks whether the cameras' images of one instant have the same stamp, or with a tolerance, whether each
/// image of the first camera has one of every other within it.
void judgeSync(const std::vector<std::vector<Timestamp>>& stamps_by_camera, double period_s,
               double tolerance_s, CheckFindings* findings);

}  // namespace vcharge::internal
