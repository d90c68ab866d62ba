#include "vcharge_camera_driver/dbc_file.h"

#include <algorithm>
#include <limits>
#include <sstream>

#include "vcharge_core/base/error.h"
#include "vcharge_core/files/file_io.h"

namespace vcharge {
namespace {

constexpr int64_t kExtendedFlag = int64_t{1} << 31;
constexpr int64_t kMaxId = 0x1fffffff;
constexpr int kMaxStandardId = 0x7ff;
constexpr int kClassicBytes = 8;

template <class T>
T readNumber(std::istream* text, const char* what) {
  T value{};
  if (!(*text >> value)) {
    throw InputError(std::string("expected ") + what);
  }
  return value;
}

void expect(std::istream* text, char expected) {
  char found = 0;
  if (!(*text >> found) || found != expected) {
    throw InputError(std::string("expected '") + expected + "'");
  }
}

/// "BO_ 170 WHEEL_SPEEDS: 8 ABS"
DbcFile::Message parseMessage(const std::string& line) {
  std::istringstream text(line.substr(3));
  DbcFile::Message message;
  const auto id = readNumber<int64_t>(&text, "the message's identifier");
  message.id = static_cast<int>(id & kMaxId);
  const bool is_extended = (id & kExtendedFlag) != 0;
  if (id < 0 || (id & ~(kExtendedFlag | kMaxId)) != 0 || is_extended != (message.id > kMaxStandardId)) {
    message.id = -1;  // such as the pseudo message of signals without message
  }
  std::getline(text >> std::ws, message.name, ':');
  message.name.erase(message.name.find_last_not_of(" \t") + 1);
  message.size = readNumber<int>(&text, "the message's size in bytes");
  return message;
}

/// "SG_ SPEED m2 : 7|16@0+ (0.01,-67.67) [0|250] "km/h" X", without the range and the receivers.
DbcFile::Signal parseSignal(const std::string& line) {
  const size_t colon = line.find(':');
  if (colon == std::string::npos) {
    throw InputError("expected ':' after the signal's name");
  }
  DbcFile::Signal signal;
  std::istringstream head(line.substr(3, colon - 3));
  std::string role;
  head >> signal.name >> role;
  if (signal.name.empty()) {
    throw InputError("expected the signal's name");
  }
  if (!role.empty()) {
    signal.is_multiplexor = role.back() == 'M';
    if (role[0] == 'm') {
      std::istringstream value(role.substr(1));
      signal.multiplexor_value = readNumber<int>(&value, "'m' and the multiplexor's value");
      signal.is_extended_multiplexed = signal.is_multiplexor;
    } else if (role != "M") {
      throw InputError("expected M, or m and the multiplexor's value, got '" + role + "'");
    }
  }
  std::istringstream text(line.substr(colon + 1));
  signal.number.start_bit = readNumber<int>(&text, "the start bit");
  expect(&text, '|');
  signal.number.length = readNumber<int>(&text, "the number of bits");
  expect(&text, '@');
  const auto order = readNumber<char>(&text, "the byte order");
  const auto sign = readNumber<char>(&text, "the sign");
  if ((order != '0' && order != '1') || (sign != '+' && sign != '-')) {
    throw InputError("expected byte order 0 or 1 and sign + or - after '@'");
  }
  signal.number.endianness = order == '0' ? ByteOrder::kBig : ByteOrder::kLittle;
  signal.number.is_signed = sign == '-';
  expect(&text, '(');
  signal.number.scale = readNumber<double>(&text, "the factor");
  expect(&text, ',');
  signal.number.offset = readNumber<double>(&text, "the offset");
  expect(&text, ')');
  const size_t quote = line.find('"', colon);
  const size_t end = quote == std::string::npos ? quote : line.find('"', quote + 1);
  if (end == std::string::npos) {
    throw InputError("expected the unit in quotes");
  }
  signal.unit = line.substr(quote + 1, end - quote - 1);
  return signal;
}

/// "SIG_VALTYPE_ 170 SPEED : 1;" and "SG_MUL_VAL_ 170 SPEED MODE 0-0, 2-2;"
void mark(const std::string& line, std::vector<DbcFile::Message>* messages) {
  std::istringstream text(line);
  std::string keyword, name, separator;
  int64_t id = 0;
  text >> keyword >> id >> name >> separator;
  for (DbcFile::Message& message : *messages) {
    for (DbcFile::Signal& signal : message.signals) {
      if (message.id == (id & kMaxId) && signal.name == name) {
        signal.is_float = signal.is_float || keyword == "SIG_VALTYPE_";
        const std::string value = std::to_string(signal.multiplexor_value.value_or(0));
        std::string ranges;
        std::getline(text >> std::ws, ranges);
        signal.is_extended_multiplexed =
            signal.is_extended_multiplexed ||
            (keyword == "SG_MUL_VAL_" && ranges.find(value + "-" + value + ";") != 0);
      }
    }
  }
}

bool startsWith(const std::string& text, const std::string& start) {
  return text.compare(0, start.size(), start) == 0;
}

}  // namespace

DbcFile DbcFile::read(const std::string& path) {
  DbcFile file;
  file.path_ = path;
  std::istringstream text(readTextFile(path));
  std::string line;
  bool in_quotes = false;  // comments may have several lines
  for (int number = 1; std::getline(text, line); ++number) {
    const bool begins_in_quotes = in_quotes;
    for (size_t i = 0; i < line.size(); ++i) {
      in_quotes = in_quotes != (line[i] == '"' && (i == 0 || line[i - 1] != '\\'));
    }
    line.erase(0, line.find_first_not_of(" \t"));
    try {
      if (begins_in_quotes) {
        continue;
      }
      if (startsWith(line, "BO_ ")) {
        file.messages_.push_back(parseMessage(line));
      } else if (startsWith(line, "SG_ ")) {
        if (file.messages_.empty()) {
          throw InputError("expected a message (BO_) before the first signal");
        }
        file.messages_.back().signals.push_back(parseSignal(line));
      } else if (startsWith(line, "SIG_VALTYPE_ ") || startsWith(line, "SG_MUL_VAL_ ")) {
        mark(line, &file.messages_);
      }
    } catch (const InputError& error) {
      throw InputError(path + ": line " + std::to_string(number) + ": " + error.what());
    }
  }
  if (file.messages_.empty()) {
    throw InputError(path + ": expected a DBC file with messages (BO_), got none");
  }
  return file;
}

DbcFile::Found DbcFile::find(const std::string& name) const {
  const size_t dot = name.find('.');
  if (dot == std::string::npos) {
    throw InputError(path_ + ": expected MESSAGE.SIGNAL, got '" + name + "'");
  }
  const std::string message_name = name.substr(0, dot);
  const auto message = std::find_if(messages_.begin(), messages_.end(),
                                    [&](const Message& each) { return each.name == message_name; });
  if (message == messages_.end()) {
    throw InputError(path_ + ": message " + message_name + ": expected a message of the file");
  }
  const std::string signal_name = name.substr(dot + 1);
  const auto hasName = [&](const Signal& each) { return each.name == signal_name; };
  const auto signal = std::find_if(message->signals.begin(), message->signals.end(), hasName);
  if (signal == message->signals.end()) {
    std::string names;
    for (const Signal& each : message->signals) {
      names += (names.empty() ? "" : ", ") + each.name;
    }
    throw InputError(path_ + ": message " + message_name + ", signal " + signal_name + ": expected one of " +
                     (names.empty() ? "its signals, it has none" : names));
  }
  return {&*message, &*signal, path_ + ": message " + message_name + ", signal " + signal_name + ": "};
}

const std::string& DbcFile::unitOf(const std::string& name) const {
  return find(name).signal->unit;
}

CanSignal DbcFile::layoutOf(const std::string& name) const {
  const auto [message, signal, where] = find(name);
  const auto require = [start = where](bool condition, const std::string& expected) {
    if (!condition) {
      throw InputError(start + "expected " + expected);
    }
  };
  const CanNumber& number = signal->number;
  require(message->id >= 0, "a message whose identifier has 11 bits, or is extended and larger");
  require(message->size <= kClassicBytes,
          "a message of classic CAN, up to 8 bytes, has " + std::to_string(message->size));
  require(!signal->is_float, "an integer, is IEEE 754");
  require(!signal->is_extended_multiplexed, "one multiplexor value, is multiplexed by several");
  require(number.length >= 1 && number.length <= 64, "1 to 64 bits, has " + std::to_string(number.length));
  require(number.start_bit >= 0 && number.start_bit < 8 * kClassicBytes,
          "a start bit within the 8 bytes of classic CAN, is " + std::to_string(number.start_bit));
  CanSignal layout;
  static_cast<CanNumber&>(layout) = number;
  layout.id = message->id;
  if (signal->multiplexor_value) {
    const auto isMultiplexor = [](const Signal& each) { return each.is_multiplexor; };
    const auto count = std::count_if(message->signals.begin(), message->signals.end(), isMultiplexor);
    require(count == 1, "one multiplexor (M) in the message, has " + std::to_string(count));
    const CanNumber& chooser =
        std::find_if(message->signals.begin(), message->signals.end(), isMultiplexor)->number;
    layout.multiplexor = {chooser.start_bit, chooser.length, chooser.endianness, *signal->multiplexor_value};
    require(chooser.length > 0, "a multiplexor with bits");
  }
  try {
    layout.validate();
  } catch (const std::invalid_argument& error) {
    throw InputError(where + error.what());
  }
  const uint64_t bits = layout.mask() | layout.multiplexor.number().mask();
  require(message->size == kClassicBytes || bits >> (8 * std::max(0, message->size)) == 0,
          "bits within the message's " + std::to_string(message->size) + " bytes");
  return layout;
}

}  // namespace vcharge
