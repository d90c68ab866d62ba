#include "vcharge_core/base/progress_bar.h"

#include <unistd.h>

#include <algorithm>
#include <cstdio>
#include <utility>

namespace vcharge {

ProgressBar::ProgressBar(std::string label)
    : label_(std::move(label)),
      is_terminal_(isatty(STDERR_FILENO) != 0),
      start_(std::chrono::steady_clock::now()),
      last_draw_(start_ - std::chrono::seconds(1)) {}

ProgressBar::~ProgressBar() {
  if (line_open_) {
    std::fputc('\n', stderr);
  }
}

void ProgressBar::update(double fraction) {
  fraction = std::clamp(fraction, 0.0, 1.0);
  const auto now = std::chrono::steady_clock::now();
  const double elapsed_s = std::chrono::duration<double>(now - start_).count();
  const int tenth = static_cast<int>(fraction * 10.0);
  if (is_terminal_) {
    if (fraction < 1.0 && now - last_draw_ < std::chrono::milliseconds(100)) {
      return;
    }
    last_draw_ = now;
    constexpr int kWidth = 30;
    const int filled = static_cast<int>(fraction * kWidth);
    const std::string bar = std::string(filled, '#') + std::string(kWidth - filled, '.');
    const double left_s = fraction > 0.0 ? elapsed_s * (1.0 - fraction) / fraction : 0.0;
    std::fprintf(stderr, "\r%s [%s] %3.0f %%  %4.0f s, %4.0f s left ", label_.c_str(), bar.c_str(),
                 100.0 * fraction, elapsed_s, left_s);
    line_open_ = true;
  } else if (tenth != last_tenth_) {
    last_tenth_ = tenth;
    std::fprintf(stderr, "%s %3d %% (%.0f s", label_.c_str(), tenth * 10, elapsed_s);
    if (fraction > 0.0 && fraction < 1.0) {
      std::fprintf(stderr, " of about %.0f s", elapsed_s / fraction);
    }
    std::fprintf(stderr, ")\n");
  }
  std::fflush(stderr);
}

}  // namespace vcharge
