#pragma once

#include <map>
#include <mutex>
#include <thread>

// A replacement for oneTBB that ThreadSanitizer understands, see ../README.md.
namespace tbb {

template <class Value>
class enumerable_thread_specific {
 public:
  Value& local() {
    const std::lock_guard<std::mutex> lock(mutex_);
    return values_[std::this_thread::get_id()];
  }

 private:
  std::mutex mutex_;
  std::map<std::thread::id, Value> values_;
};

}  // namespace tbb
