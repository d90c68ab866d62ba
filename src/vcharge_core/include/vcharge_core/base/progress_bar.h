#pragma once

#include <chrono>
#include <string>

namespace vcharge {

/// A progress line of a command-line tool on standard error: redrawn in place on a terminal, otherwise a new
/// line every ten percent. Not thread safe.
class ProgressBar {
 public:
  explicit ProgressBar(std::string label);
  /// Ends the current line.
  ~ProgressBar();
  ProgressBar(const ProgressBar&) = delete;
  ProgressBar& operator=(const ProgressBar&) = delete;

  /// `fraction` is clamped to [0, 1].
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
