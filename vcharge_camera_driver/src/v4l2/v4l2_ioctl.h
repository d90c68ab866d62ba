#pragma once

#include <sys/ioctl.h>

#include <cerrno>

namespace vcharge {

/// ioctl() that a signal does not end.
template <class Argument>
int v4l2Ioctl(int fd, unsigned long request, Argument* argument) {
  int result = 0;
  do {
    result = ::ioctl(fd, request, argument);
  } while (result < 0 && errno == EINTR);
  return result;
}

}  // namespace vcharge
