#pragma once

#include <chrono>
#include <cstdint>
#include <functional>
#include <ostream>
#include <string>

namespace vcharge {

/// Difference of two Timestamps, in integer nanoseconds.
using Duration = std::chrono::nanoseconds;

/// Rounds to whole nanoseconds.
Duration durationFromSeconds(double seconds);

inline double toSeconds(Duration duration) {
  return static_cast<double>(duration.count()) * 1e-9;
}

/// A point in time as integer nanoseconds since the epoch of the drive's clock (ROS time). A value type.
class Timestamp {
 public:
  constexpr Timestamp() = default;
  static constexpr Timestamp fromNanoseconds(int64_t nanoseconds) { return Timestamp(nanoseconds); }
  /// Exact to about 0.2 microseconds for present-day dates; prefer integers where available.
  static Timestamp fromSeconds(double seconds);

  constexpr int64_t nanoseconds() const { return nanoseconds_; }
  double seconds() const { return static_cast<double>(nanoseconds_) * 1e-9; }

  friend constexpr bool operator==(Timestamp a, Timestamp b) { return a.nanoseconds_ == b.nanoseconds_; }
  friend constexpr bool operator!=(Timestamp a, Timestamp b) { return a.nanoseconds_ != b.nanoseconds_; }
  friend constexpr bool operator<(Timestamp a, Timestamp b) { return a.nanoseconds_ < b.nanoseconds_; }
  friend constexpr bool operator<=(Timestamp a, Timestamp b) { return a.nanoseconds_ <= b.nanoseconds_; }
  friend constexpr bool operator>(Timestamp a, Timestamp b) { return a.nanoseconds_ > b.nanoseconds_; }
  friend constexpr bool operator>=(Timestamp a, Timestamp b) { return a.nanoseconds_ >= b.nanoseconds_; }
  friend constexpr Duration operator-(Timestamp a, Timestamp b) {
    return Duration(a.nanoseconds_ - b.nanoseconds_);
  }
  friend constexpr Timestamp operator+(Timestamp a, Duration b) {
    return Timestamp(a.nanoseconds_ + b.count());
  }
  friend constexpr Timestamp operator-(Timestamp a, Duration b) {
    return Timestamp(a.nanoseconds_ - b.count());
  }

 private:
  constexpr explicit Timestamp(int64_t nanoseconds) : nanoseconds_(nanoseconds) {}
  int64_t nanoseconds_ = 0;
};

/// Seconds with nine decimals, exact: "1342626148.354042000".
std::string toString(Timestamp stamp);
std::ostream& operator<<(std::ostream& stream, Timestamp stamp);

/// Parses the text of toString() without going through a double. Throws InputError.
Timestamp timestampFromString(const std::string& text);

}  // namespace vcharge

template <>
struct std::hash<vcharge::Timestamp> {
  size_t operator()(vcharge::Timestamp stamp) const noexcept {
    return std::hash<int64_t>()(stamp.nanoseconds());
  }
};
