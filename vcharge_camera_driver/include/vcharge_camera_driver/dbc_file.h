#pragma once

#include <optional>
#include <set>
#include <string>
#include <vector>

#include "vcharge_camera_driver/can_signal.h"

namespace vcharge {

/// Signals of a car's messages, from a DBC file. Only messages and signals are read; the rest is skipped.
class DbcFile {
 public:
  struct Signal {
    std::string name;
    CanNumber number;  ///< in the file's unit; not checked
    std::string unit;
    bool is_multiplexor = false;
    std::optional<int> multiplexor_value;
    bool is_extended_multiplexed = false;  ///< several values or nested multiplexors
    bool is_float = false;                 ///< IEEE 754
  };
  struct Message {
    std::string name;
    int id = 0;
    int size = 0;  ///< bytes
    std::vector<Signal> signals;
  };

  /// Throws InputError naming the file and the line.
  static DbcFile read(const std::string& path);

  /// The layout of "MESSAGE.SIGNAL" in the file's unit. Throws InputError naming file, message and signal if
  /// there is none, or none that a classic CAN message of its size can have.
  CanSignal layoutOf(const std::string& name) const;
  /// The unit of "MESSAGE.SIGNAL" as the file tells it.
  const std::string& unitOf(const std::string& name) const;
  const std::vector<Message>& messages() const { return messages_; }

 private:
  struct Found {
    const Message* message;
    const Signal* signal;
    std::string where;  // begins an error's text
  };
  Found find(const std::string& name) const;

  std::string path_;
  std::vector<Message> messages_;
};

}  // namespace vcharge
