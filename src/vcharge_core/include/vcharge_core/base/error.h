#pragma once

#include <stdexcept>
#include <string>

namespace vcharge {

/// Error for a bad file, message or option. The text names the file (or topic), the key and what is expected.
class InputError : public std::runtime_error {
 public:
  using std::runtime_error::runtime_error;
};

/// Throws std::logic_error with `message` unless `condition` holds. For bugs of the caller, not for bad
/// input.
inline void check(bool condition, const char* message) {
  if (!condition) {
    throw std::logic_error(message);
  }
}

}  // namespace vcharge
