#pragma once

#include <chrono>
#include <string>

namespace vcharge {

/// A progress line on stderr for command-line tools: redrawn in place on a terminal, one line every ten
/// percent elsewhere. Not thread safe.
class ProgressBar {
 public:
  explicit ProgressBar(std::string label);
  /// Ends the line where the work was left.
  ~ProgressBar();
  ProgressBar(const ProgressBar&) = delete;
  ProgressBar& operator=(const ProgressBar&) = delete;

  /// fraction in [0, 1], clamped.
  void update(double fraction);

 private:
  std::string label_;
  bool is_terminal_;
  std::chrono::steady_clock::time_point start_;
  std::chrono::steady_clock::time_point last_draw_;
  int last_tenth_ = -1;
  bool line_open_ = false;
};

}  // namespace vcharge
