#include "vcharge_camera_driver/can_reader.h"

#include <linux/can.h>
#include <linux/can/error.h>
#include <linux/can/raw.h>
#include <net/if.h>
#include <poll.h>
#include <sys/eventfd.h>
#include <sys/ioctl.h>
#include <sys/socket.h>

#include <algorithm>
#include <cerrno>
#include <cstring>

#include "vcharge_core/base/error.h"

namespace vcharge {
namespace {

constexpr int kReconnect_ms = 500;

struct Received {
  ssize_t size = 0;
  can_frame frame{};
  std::optional<Timestamp> stamp;
};

Received receive(int fd) {
  Received received;
  iovec part{&received.frame, sizeof(received.frame)};
  alignas(cmsghdr) char control[CMSG_SPACE(sizeof(timespec))];
  msghdr message{};
  message.msg_iov = &part;
  message.msg_iovlen = 1;
  message.msg_control = control;
  message.msg_controllen = sizeof(control);
  received.size = recvmsg(fd, &message, MSG_DONTWAIT);
  if (received.size < 0) {
    return received;
  }
  if ((message.msg_flags & MSG_TRUNC) != 0) {
    received.size = sizeof(received.frame) + 1;
  }
  for (cmsghdr* header = CMSG_FIRSTHDR(&message); header != nullptr; header = CMSG_NXTHDR(&message, header)) {
    if (header->cmsg_level == SOL_SOCKET && header->cmsg_type == SO_TIMESTAMPNS) {
      timespec time{};
      std::memcpy(&time, CMSG_DATA(header), sizeof(time));
      received.stamp = Timestamp::fromNanoseconds(int64_t{1000000000} * time.tv_sec + time.tv_nsec);
    }
  }
  return received;
}

}  // namespace

FileDescriptor openCanSocket(const std::string& interface) {
  const auto fail = [&](const std::string& what) {
    throw InputError(interface + ": " + what + ": " + std::strerror(errno));
  };
  FileDescriptor fd(socket(PF_CAN, SOCK_RAW | SOCK_CLOEXEC | SOCK_NONBLOCK, CAN_RAW));
  if (!fd) {
    fail("the kernel has no CAN sockets");
  }
  ifreq request{};
  if (interface.size() >= sizeof(request.ifr_name)) {
    throw InputError(interface + ": expected the name of a network interface");
  }
  std::strncpy(request.ifr_name, interface.c_str(), sizeof(request.ifr_name) - 1);
  if (ioctl(fd.get(), SIOCGIFINDEX, &request) != 0) {
    fail("is not a CAN interface");
  }
  const can_err_mask_t errors = CAN_ERR_MASK;
  const int on = 1;
  setsockopt(fd.get(), SOL_CAN_RAW, CAN_RAW_ERR_FILTER, &errors, sizeof(errors));
  setsockopt(fd.get(), SOL_SOCKET, SO_TIMESTAMPNS, &on, sizeof(on));
  sockaddr_can address{};
  address.can_family = AF_CAN;
  address.can_ifindex = request.ifr_ifindex;
  if (bind(fd.get(), reinterpret_cast<const sockaddr*>(&address), sizeof(address)) != 0) {
    fail("cannot be read");
  }
  return fd;
}

CanReader::CanReader(Open open, const CanWheelOptions& options, ClockMap::Clock drive_clock, double timeout_s)
    : open_(std::move(open)),
      decoder_(options),
      drive_clock_(std::move(drive_clock)),
      timeout_(durationFromSeconds(timeout_s)),
      wake_(eventfd(0, EFD_CLOEXEC | EFD_NONBLOCK)) {
  check(static_cast<bool>(wake_), "CanReader: no event descriptor");
}

void CanReader::stop() {
  eventfd_write(wake_.get(), 1);
}

CanStatus CanReader::status() const {
  const std::lock_guard<std::mutex> lock(mutex_);
  return status_;
}

void CanReader::setMessage(bool connected, const std::string& message) {
  const std::lock_guard<std::mutex> lock(mutex_);
  status_.connections += connected && !status_.connected ? 1 : 0;
  status_.connected = connected;
  status_.message = message;
}

bool CanReader::readFrames(int fd, const WheelsCallback& callback) {
  while (true) {
    const Received received = receive(fd);
    if (received.size < 0 && (errno == EAGAIN || errno == EINTR)) {
      return true;
    }
    if (received.size <= 0) {
      setMessage(false, std::string("the bus cannot be read: ") +
                            (received.size == 0 ? "it is closed" : std::strerror(errno)));
      return false;
    }
    std::optional<WheelMeasurement> wheels;
    {
      const std::lock_guard<std::mutex> lock(mutex_);
      const can_frame& raw = received.frame;
      if (received.size != CAN_MTU || raw.can_dlc > CAN_MAX_DLEN) {
        ++status_.bad_frames;
        continue;
      }
      if ((raw.can_id & CAN_ERR_FLAG) != 0) {
        ++status_.error_frames;
        if ((raw.can_id & CAN_ERR_BUSOFF) != 0) {
          status_.bus_off = true;
          status_.message = "the controller is bus-off";
        }
        continue;
      }
      if ((raw.can_id & CAN_RTR_FLAG) != 0) {
        continue;
      }
      if (status_.bus_off) {  // data was received again after bus-off
        status_.bus_off = false;
        status_.message = "reading";
      }
      CanFrame frame;
      frame.is_extended = (raw.can_id & CAN_EFF_FLAG) != 0;
      frame.id = raw.can_id & (frame.is_extended ? CAN_EFF_MASK : CAN_SFF_MASK);
      frame.size = raw.can_dlc;
      std::copy(std::begin(raw.data), std::end(raw.data), frame.data.begin());
      wheels = decoder_.add(frame, received.stamp ? *received.stamp : drive_clock_());
      status_.decoded = decoder_.counts();
      if (wheels) {
        ++status_.measurements;
        status_.silent = false;
        last_wheels_ = monotonicNow();
      }
    }
    if (wheels) {
      callback(*wheels);
    }
  }
}

void CanReader::run(const WheelsCallback& callback) {
  FileDescriptor bus;
  last_wheels_ = monotonicNow();
  while (true) {
    if (!bus) {
      try {
        bus = open_();
        setMessage(true, "reading");
      } catch (const InputError& error) {
        setMessage(false, error.what());
      }
    }
    pollfd waiting[2] = {{wake_.get(), POLLIN, 0},
                         {bus.get(), POLLIN, 0}};  // poll() ignores a descriptor of -1
    const auto timeout_ms =
        static_cast<int>(std::chrono::duration_cast<std::chrono::milliseconds>(timeout_).count());
    const int ready = poll(waiting, 2, bus ? timeout_ms + 1 : kReconnect_ms);
    if ((waiting[0].revents & POLLIN) != 0) {
      return;
    }
    if (ready > 0 && waiting[1].revents != 0 && !readFrames(bus.get(), callback)) {
      bus.reset();
      pollfd pause{wake_.get(), POLLIN, 0};
      poll(&pause, 1, kReconnect_ms);
    }
    const std::lock_guard<std::mutex> lock(mutex_);
    status_.silent = monotonicNow() - last_wheels_ >= timeout_;
  }
}

}  // namespace vcharge
