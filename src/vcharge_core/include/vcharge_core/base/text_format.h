#pragma once

#include <array>
#include <cstdio>
#include <string>

namespace vcharge {

/// The number with `digits` digits after the decimal point.
inline std::string toText(double value, int digits) {
  std::array<char, 64> text{};
  std::snprintf(text.data(), text.size(), "%.*f", digits, value);
  return text.data();
}

}  // namespace vcharge
