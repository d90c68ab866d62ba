#include "vcharge_core/base/timestamp.h"

#include <cctype>
#include <cmath>
#include <cstdio>

#include "vcharge_core/base/error.h"

namespace vcharge {
namespace {
constexpr int64_t kNanosecondsPerSecond = 1000000000;
}

Duration durationFromSeconds(double seconds) {
  return Duration(static_cast<int64_t>(std::llround(seconds * 1e9)));
}

Timestamp Timestamp::fromSeconds(double seconds) {
  return Timestamp(static_cast<int64_t>(std::llround(seconds * 1e9)));
}

std::string toString(Timestamp stamp) {
  const int64_t nanoseconds = stamp.nanoseconds();
  const char* sign = nanoseconds < 0 ? "-" : "";
  const uint64_t magnitude =
      nanoseconds < 0 ? 0 - static_cast<uint64_t>(nanoseconds) : static_cast<uint64_t>(nanoseconds);
  char text[40];
  std::snprintf(text, sizeof(text), "%s%llu.%09llu", sign,
                static_cast<unsigned long long>(magnitude / kNanosecondsPerSecond),
                static_cast<unsigned long long>(magnitude % kNanosecondsPerSecond));
  return text;
}

std::ostream& operator<<(std::ostream& stream, Timestamp stamp) {
  return stream << toString(stamp);
}

Timestamp timestampFromString(const std::string& text) {
  size_t i = 0;
  const bool negative = !text.empty() && text[0] == '-';
  if (negative) {
    i = 1;
  }
  const auto fail = [&]() -> Timestamp {
    throw InputError("'" + text + "': expected a time in seconds with up to nine decimals");
  };
  const auto isDigit = [&](size_t position) {
    return position < text.size() && std::isdigit(static_cast<unsigned char>(text[position])) != 0;
  };
  if (!isDigit(i)) {
    return fail();
  }
  int64_t seconds = 0;
  for (; isDigit(i); ++i) {
    seconds = seconds * 10 + (text[i] - '0');
    if (seconds > 9000000000) {  // more than 64 bits of nanoseconds can hold
      return fail();
    }
  }
  int64_t fraction = 0;
  if (i < text.size() && text[i] == '.') {
    ++i;
    int64_t unit = kNanosecondsPerSecond / 10;
    for (; isDigit(i); ++i) {
      if (unit == 0) {
        return fail();
      }
      fraction += unit * (text[i] - '0');
      unit /= 10;
    }
  }
  if (i != text.size()) {
    return fail();
  }
  const int64_t magnitude = seconds * kNanosecondsPerSecond + fraction;
  return Timestamp::fromNanoseconds(negative ? -magnitude : magnitude);
}

}  // namespace vcharge
