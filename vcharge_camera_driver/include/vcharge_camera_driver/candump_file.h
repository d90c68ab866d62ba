#pragma once

#include <optional>
#include <string>
#include <vector>

#include "vcharge_camera_driver/can_signal.h"
#include "vcharge_core/base/timestamp.h"

namespace vcharge {

struct StampedCanFrame {
  Timestamp stamp;
  CanFrame frame;
};

/// Reads a line of `candump -L`: "(46408.584954) can0 0AA#25B525B525A0258D". Empty for remote, error and CAN
/// FD frames. Throws InputError that says what was expected.
std::optional<StampedCanFrame> parseCandumpLine(const std::string& line);

/// Reads a log of `candump -l` or `candump -L`, in its order: the frames of `interface`, or of the only one
/// if it is empty. Throws InputError naming the file and the line; also for a log without data frames.
std::vector<StampedCanFrame> readCandump(const std::string& path, const std::string& interface = "");

}  // namespace vcharge
