#pragma once

#include <condition_variable>
#include <cstddef>
#include <cstdint>
#include <functional>
#include <map>
#include <mutex>
#include <thread>
#include <utility>

namespace vcharge {

/// Works on tasks in a thread of its own, newest first: a task that has not been begun when its channel (a
/// camera, say) brings a newer one is dropped and counted. Channels take turns. For live use; replay without
/// loss calls the work directly.
template <class Task>
class NewestFirstWorker {
 public:
  /// `work` must not throw.
  explicit NewestFirstWorker(std::function<void(const Task&)> work)
      : work_(std::move(work)), thread_([this] { run(); }) {}
  /// Waits for the task in work.
  ~NewestFirstWorker() {
    {
      const std::lock_guard<std::mutex> lock(mutex_);
      stop_ = true;
    }
    changed_.notify_all();
    thread_.join();
  }
  NewestFirstWorker(const NewestFirstWorker&) = delete;
  NewestFirstWorker& operator=(const NewestFirstWorker&) = delete;

  void push(size_t channel, Task task) {
    {
      const std::lock_guard<std::mutex> lock(mutex_);
      const bool is_first = waiting_.insert_or_assign(channel, std::move(task)).second;
      dropped_[channel] += is_first ? 0 : 1;
    }
    changed_.notify_all();
  }

  uint64_t numDropped(size_t channel) const {
    const std::lock_guard<std::mutex> lock(mutex_);
    const auto found = dropped_.find(channel);
    return found == dropped_.end() ? 0 : found->second;
  }

 private:
  void run() {
    std::unique_lock<std::mutex> lock(mutex_);
    while (true) {
      changed_.wait(lock, [this] { return stop_ || !waiting_.empty(); });
      if (stop_) {
        return;
      }
      auto next = waiting_.upper_bound(last_channel_);
      if (next == waiting_.end()) {
        next = waiting_.begin();
      }
      last_channel_ = next->first;
      const Task task = std::move(next->second);
      waiting_.erase(next);
      lock.unlock();
      work_(task);
      lock.lock();
    }
  }

  const std::function<void(const Task&)> work_;
  mutable std::mutex mutex_;
  std::condition_variable changed_;
  std::map<size_t, Task> waiting_;
  std::map<size_t, uint64_t> dropped_;
  size_t last_channel_ = 0;
  bool stop_ = false;
  std::thread thread_;
};

}  // namespace vcharge
