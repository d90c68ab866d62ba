// Emulated cameras for tests, without hardware and kernel modules: linked or preloaded before libc. A file in
// the folder $VCHARGE_EMULATED_CAMERAS represents the device node of a camera, configured by its lines
// "key=value"; removing the file unplugs the camera. open(), ioctl(), mmap() and close() of such files are
// handled here; poll() is the kernel's, since the file descriptor is one end of a socket pair.
#include <dlfcn.h>
#include <fcntl.h>
#include <sys/mman.h>
#include <sys/socket.h>
#include <unistd.h>

#include <atomic>
#include <cerrno>
#include <chrono>
#include <condition_variable>
#include <cstdarg>
#include <cstdlib>
#include <ctime>
#include <map>
#include <memory>
#include <mutex>
#include <string>
#include <thread>

#include "emulated_camera.h"

namespace vcharge::emulator {
namespace {

template <class Function>
Function* real(const char* name) {
  return reinterpret_cast<Function*>(dlsym(RTLD_NEXT, name));
}

int64_t nanoseconds(clockid_t clock) {
  timespec now{};
  clock_gettime(clock, &now);
  return 1000000000LL * now.tv_sec + now.tv_nsec;
}

// The emulated hardware: a thread that lives while a camera is open.
class Hardware {
 public:
  static Hardware& instance() {
    static Hardware hardware;
    return hardware;
  }
  ~Hardware() { join(); }

  int open(const std::string& path) {
    if (access(path.c_str(), F_OK) != 0) {
      errno = ENOENT;
      return -1;
    }
    int ends[2];
    if (socketpair(AF_UNIX, SOCK_SEQPACKET | SOCK_CLOEXEC, 0, ends) != 0) {
      return -1;
    }
    const int memory = memfd_create("frames", MFD_CLOEXEC);
    std::unique_lock<std::recursive_mutex> lock(mutex_);
    if (cameras_.empty()) {
      lock.unlock();
      join();
      lock.lock();
      stop_ = false;
    }
    cameras_[ends[0]] =
        std::make_shared<EmulatedCamera>(path, readCameraConfig(path), ends[0], ends[1], memory);
    num_open_ = cameras_.size();
    if (!thread_.joinable()) {
      thread_ = std::thread([this] { run(); });
    }
    return ends[0];
  }

  bool isCamera(int fd) {
    if (num_open_ == 0) {
      return false;  // checked without the lock, since nearly every call of a process ends here
    }
    const std::lock_guard<std::recursive_mutex> lock(mutex_);
    return cameras_.count(fd) != 0;
  }

  int control(int fd, unsigned long request, void* argument) {
    const std::lock_guard<std::recursive_mutex> lock(mutex_);
    const int error = cameras_.at(fd)->control(request, argument);
    changed_.notify_all();
    errno = error != 0 ? error : errno;
    return error == 0 ? 0 : -1;
  }

  int memoryFd(int fd) {
    const std::lock_guard<std::recursive_mutex> lock(mutex_);
    return cameras_.at(fd)->memoryFd();
  }

  void close(int fd) {
    const std::lock_guard<std::recursive_mutex> lock(mutex_);
    const auto found = cameras_.find(fd);
    const std::shared_ptr<EmulatedCamera> last = found->second;
    cameras_.erase(found);
    num_open_ = cameras_.size();
    stop_ = cameras_.empty();
    changed_.notify_all();
  }

  double cpuSeconds() const { return static_cast<double>(cpu_ns_) * 1e-9; }

 private:
  void join() {
    {
      const std::lock_guard<std::recursive_mutex> lock(mutex_);
      stop_ = true;
      changed_.notify_all();
    }
    if (thread_.joinable()) {
      thread_.join();
      thread_ = std::thread();
    }
  }

  void run() {
    const int64_t cpu_before_ns = cpu_ns_;
    std::unique_lock<std::recursive_mutex> lock(mutex_);
    while (!stop_) {
      int64_t next_ns = nanoseconds(CLOCK_MONOTONIC) + 20000000;  // period of the check for unplugged cameras
      for (const auto& [fd, camera] : cameras_) {
        next_ns = std::min(next_ns, camera->nextDelivery());
      }
      changed_.wait_until(lock, std::chrono::steady_clock::time_point(std::chrono::nanoseconds(next_ns)));
      for (const auto& [fd, camera] : cameras_) {
        camera->work(nanoseconds(CLOCK_MONOTONIC));
      }
      cpu_ns_ = cpu_before_ns + nanoseconds(CLOCK_THREAD_CPUTIME_ID);
    }
  }

  std::recursive_mutex mutex_;  // recursive, since a camera's own mmap() and close() are handled here too
  std::condition_variable_any changed_;
  std::map<int, std::shared_ptr<EmulatedCamera>> cameras_;  // key: the application's file descriptor
  std::atomic<size_t> num_open_{0};
  bool stop_ = false;
  std::thread thread_;
  std::atomic<int64_t> cpu_ns_{0};
};

bool isEmulated(const char* path) {
  const char* folder = std::getenv("VCHARGE_EMULATED_CAMERAS");
  return folder != nullptr && *folder != 0 && std::string(path).rfind(std::string(folder) + "/video", 0) == 0;
}

int openAny(const char* name, const char* path, int flags, mode_t mode) {
  if (isEmulated(path)) {
    return Hardware::instance().open(path);
  }
  return real<int(const char*, int, mode_t)>(name)(path, flags, mode);
}

void* mapAny(const char* name, void* address, size_t size, int protection, int flags, int fd, off_t offset) {
  if (fd >= 0 && Hardware::instance().isCamera(fd)) {
    fd = Hardware::instance().memoryFd(fd);
  }
  return real<void*(void*, size_t, int, int, int, off_t)>(name)(address, size, protection, flags, fd, offset);
}

mode_t modeOf(int flags, va_list arguments) {
  return (flags & (O_CREAT | O_TMPFILE)) != 0 ? static_cast<mode_t>(va_arg(arguments, int)) : 0;
}

}  // namespace
}  // namespace vcharge::emulator

using vcharge::emulator::Hardware;

extern "C" {

/// CPU time of the emulated hardware in this process, to subtract from the driver's.
double vchargeEmulatorCpuSeconds() {
  return Hardware::instance().cpuSeconds();
}

int open(const char* path, int flags, ...) {
  va_list arguments;
  va_start(arguments, flags);
  const mode_t mode = vcharge::emulator::modeOf(flags, arguments);
  va_end(arguments);
  return vcharge::emulator::openAny("open", path, flags, mode);
}

int open64(const char* path, int flags, ...) {
  va_list arguments;
  va_start(arguments, flags);
  const mode_t mode = vcharge::emulator::modeOf(flags, arguments);
  va_end(arguments);
  return vcharge::emulator::openAny("open64", path, flags, mode);
}

int ioctl(int fd, unsigned long request, ...) noexcept {
  va_list arguments;
  va_start(arguments, request);
  void* argument = va_arg(arguments, void*);
  va_end(arguments);
  if (Hardware::instance().isCamera(fd)) {
    return Hardware::instance().control(fd, request, argument);
  }
  return vcharge::emulator::real<int(int, unsigned long, void*)>("ioctl")(fd, request, argument);
}

void* mmap(void* address, size_t size, int protection, int flags, int fd, off_t offset) noexcept {
  return vcharge::emulator::mapAny("mmap", address, size, protection, flags, fd, offset);
}

void* mmap64(void* address, size_t size, int protection, int flags, int fd, off64_t offset) noexcept {
  return vcharge::emulator::mapAny("mmap64", address, size, protection, flags, fd, offset);
}

int close(int fd) {
  if (Hardware::instance().isCamera(fd)) {
    Hardware::instance().close(fd);
  }
  return vcharge::emulator::real<int(int)>("close")(fd);
}

}  // extern "C"
