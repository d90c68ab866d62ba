#pragma once

#include <ctime>
#include <string>

namespace vcharge {

/// The time of day as in 2026-01-31T12:00:00Z, for provenance.
inline std::string utcNow() {
  const std::time_t now = std::time(nullptr);
  std::tm parts{};
  gmtime_r(&now, &parts);
  char text[32] = {};
  std::strftime(text, sizeof(text), "%Y-%m-%dT%H:%M:%SZ", &parts);
  return text;
}

}  // namespace vcharge
