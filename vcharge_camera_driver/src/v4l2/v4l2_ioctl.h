#pragma once

#include <sys/ioctl.h>

#include <cerrno>

namespace vcharge {

/// ioctl() that is repeated when interrupted by a signal.
template <class Argument>
int v4l2Ioctl(int fd, unsigned long request, Argument* argument) {
  int result = 0;
  do {
    result = ::ioctl(fd, request, argument);
  } while (result < 0 && errno == EINTR);
  return result;
}

}  // namespace vcharge
