#pragma once

#include <cstddef>
#include <functional>
#include <limits>
#include <type_traits>
#include <utility>

namespace vcharge {

/// Height of the ground in the world frame, in metres: a thread-safe function of x and y or, where levels lie
/// over each other, of x, y and a height, which gives the level nearest to that. Null: level ground at z = 0.
class GroundHeight {
 public:
  GroundHeight(std::nullptr_t /*level*/ = nullptr) {}  // NOLINT: implicit
  template <class Function, class = std::enable_if_t<!std::is_same_v<std::decay_t<Function>, GroundHeight> &&
                                                     !std::is_null_pointer_v<Function>>>
  GroundHeight(Function function) {  // NOLINT: implicit
    if constexpr (std::is_invocable_v<Function, double, double, double>) {
      height_ = std::move(function);
    } else {
      height_ = [function = std::move(function)](double x_m, double y_m, double /*near_z_m*/) {
        return function(x_m, y_m);
      };
    }
  }

  explicit operator bool() const { return static_cast<bool>(height_); }
  /// The uppermost level by default.
  double operator()(double x_m, double y_m, double near_z_m = std::numeric_limits<double>::infinity()) const {
    return height_(x_m, y_m, near_z_m);
  }

 private:
  std::function<double(double, double, double)> height_;
};

}  // namespace vcharge
