#pragma once

#include <functional>
#include <mutex>
#include <string>

#include "vcharge_camera_driver/can_wheel_decoder.h"
#include "vcharge_camera_driver/clock_map.h"
#include "vcharge_camera_driver/file_descriptor.h"

namespace vcharge {

/// Opens a raw SocketCAN socket of an interface ("can0") that also reports bus errors and reception times.
/// Throws InputError naming the interface if there is none.
FileDescriptor openCanSocket(const std::string& interface);

/// State of the bus, for /diagnostics.
struct CanStatus {
  bool connected = false;
  bool bus_off = false;
  bool silent = false;  ///< no wheel data for timeout_s
  std::string message;
  uint64_t connections = 0;
  uint64_t error_frames = 0;
  uint64_t bad_frames = 0;  ///< frames whose size differs from a CAN frame's
  uint64_t measurements = 0;
  CanWheelCounts decoded;
};

/// Reads wheel data from a socket with Linux' `struct can_frame`, sleeping between frames. Reopens a socket
/// that ends or fails.
class CanReader {
 public:
  using Open = std::function<FileDescriptor()>;
  using WheelsCallback = std::function<void(const WheelMeasurement&)>;

  /// `open` throws InputError if there is no bus. `drive_clock` provides the stamps if the socket does not.
  CanReader(Open open, const CanWheelOptions& options, ClockMap::Clock drive_clock, double timeout_s = 0.5);

  /// Blocks until stop().
  void run(const WheelsCallback& callback);
  void stop();               ///< thread safe
  CanStatus status() const;  ///< thread safe

 private:
  /// Returns false at the end of the socket.
  bool readFrames(int fd, const WheelsCallback& callback);
  void setMessage(bool connected, const std::string& message);

  const Open open_;
  CanWheelDecoder decoder_;
  const ClockMap::Clock drive_clock_;
  const Duration timeout_;
  Timestamp last_wheels_;  // on the monotonic clock
  FileDescriptor wake_;
  mutable std::mutex mutex_;
  CanStatus status_;
};

}  // namespace vcharge
