#pragma once

#include <functional>
#include <mutex>
#include <string>

#include "vcharge_camera_driver/can_wheel_decoder.h"
#include "vcharge_camera_driver/clock_map.h"
#include "vcharge_camera_driver/file_descriptor.h"

namespace vcharge {

/// A raw SocketCAN socket of an interface ("can0") that also tells errors of the bus and when frames came.
/// InputError naming the interface where there is none.
FileDescriptor openCanSocket(const std::string& interface);

/// State of the bus for /diagnostics.
struct CanStatus {
  bool connected = false;
  bool bus_off = false;
  bool silent = false;  ///< no wheel data for timeout_s
  std::string message;
  uint64_t connections = 0;
  uint64_t error_frames = 0;
  uint64_t bad_frames = 0;  ///< not of a CAN frame's size
  uint64_t ticks = 0;
  CanWheelCounts decoded;
};

/// Reads wheel data from a socket that carries Linux' `struct can_frame`, asleep between frames. A socket
/// that ends or fails is opened anew.
class CanReader {
 public:
  using Open = std::function<FileDescriptor()>;
  using TicksCallback = std::function<void(const WheelTicks&)>;

  /// `open` throws InputError where there is no bus. `drive_clock` stamps frames whose socket does not.
  CanReader(Open open, const CanWheelOptions& options, ClockMap::Clock drive_clock, double timeout_s = 0.5);

  /// Until stop().
  void run(const TicksCallback& callback);
  void stop();               ///< thread safe
  CanStatus status() const;  ///< thread safe

 private:
  /// False when the socket is at its end.
  bool readFrames(int fd, const TicksCallback& callback);
  void setMessage(bool connected, const std::string& message);

  const Open open_;
  CanWheelDecoder decoder_;
  const ClockMap::Clock drive_clock_;
  const Duration timeout_;
  Timestamp last_ticks_;  // monotonic
  FileDescriptor wake_;
  mutable std::mutex mutex_;
  CanStatus status_;
};

}  // namespace vcharge
