#include "vcharge_camera_driver/candump_file.h"

#include <linux/can.h>

#include <sstream>

#include "vcharge_core/base/error.h"
#include "vcharge_core/files/file_io.h"

namespace vcharge {
namespace {

constexpr char kFormat[] = "expected '(seconds) interface id#data'";
constexpr char kDigits[] = "0123456789abcdefABCDEF";

bool isHexadecimal(const std::string& text) {
  return !text.empty() && text.find_first_not_of(kDigits) == std::string::npos;
}

}  // namespace

std::optional<StampedCanFrame> parseCandumpLine(const std::string& line) {
  std::istringstream fields(line);
  std::string time, interface, content, rest;
  if (!(fields >> time >> interface >> content) || time.size() < 3 || time.front() != '(' ||
      time.back() != ')') {
    throw InputError(kFormat);
  }
  if (fields >> rest && rest != "T" && rest != "R") {  // some versions tell the direction
    throw InputError(std::string(kFormat) + ", found '" + rest + "' after it");
  }
  const size_t separator = content.find('#');
  const std::string id = content.substr(0, separator);
  if (separator == std::string::npos || !isHexadecimal(id) || (id.size() != 3 && id.size() != 8)) {
    throw InputError("expected id#data with three or eight hexadecimal digits of the id, got '" + content +
                     "'");
  }
  StampedCanFrame result;
  result.stamp = timestampFromString(time.substr(1, time.size() - 2));
  const auto bits = static_cast<uint32_t>(std::stoul(id, nullptr, 16));
  result.frame.is_extended = id.size() == 8;
  result.frame.id = bits & CAN_EFF_MASK;
  const std::string data = content.substr(separator + 1);
  if ((id.size() == 8 && (bits & CAN_ERR_FLAG) != 0) ||
      (!data.empty() && (data[0] == 'R' || data[0] == '#'))) {
    return std::nullopt;
  }
  if (data.size() % 2 != 0 || data.size() > 16 || !(data.empty() || isHexadecimal(data))) {
    throw InputError("expected up to eight bytes of two hexadecimal digits, got '" + data + "'");
  }
  result.frame.size = static_cast<uint8_t>(data.size() / 2);
  for (size_t i = 0; i < result.frame.size; ++i) {
    result.frame.data.at(i) = static_cast<uint8_t>(std::stoul(data.substr(2 * i, 2), nullptr, 16));
  }
  return result;
}

std::vector<StampedCanFrame> readCandump(const std::string& path, const std::string& interface) {
  std::istringstream text(readTextFile(path));
  std::vector<StampedCanFrame> frames;
  std::string line;
  std::string bus = interface;
  for (int number = 1; std::getline(text, line); ++number) {
    std::istringstream fields(line);
    std::string time, name;
    if (!(fields >> time)) {
      continue;
    }
    fields >> name;
    try {
      const std::optional<StampedCanFrame> frame = parseCandumpLine(line);
      if (name != bus && !bus.empty() && interface.empty()) {
        throw InputError("expected frames of one interface, or its choice, got " + name + " after " + bus);
      }
      bus = interface.empty() ? name : interface;
      if (frame && name == bus) {
        frames.push_back(*frame);
      }
    } catch (const InputError& error) {
      throw InputError(path + ": line " + std::to_string(number) + ": " + error.what());
    }
  }
  if (frames.empty()) {
    throw InputError(path + ": expected a log of candump with data frames" +
                     (interface.empty() ? "" : " of " + interface) + ", got none");
  }
  return frames;
}

}  // namespace vcharge
