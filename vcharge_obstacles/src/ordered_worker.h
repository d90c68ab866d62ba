#pragma once

#include <condition_variable>
#include <cstddef>
#include <cstdint>
#include <deque>
#include <functional>
#include <mutex>
#include <thread>
#include <utility>

namespace vcharge {

/// Works on tasks in a thread of its own, in the order in which they came. Of the tasks that may be dropped
/// no more than max_droppable wait: a newer one takes the place of the oldest, which is counted.
template <class Task>
class OrderedWorker {
 public:
  /// `work` must not throw. max_droppable 0: nothing is ever dropped.
  OrderedWorker(std::function<void(const Task&)> work, size_t max_droppable)
      : work_(std::move(work)), max_droppable_(max_droppable), thread_([this] { run(); }) {}
  /// Waits for the task in work; those that wait are not begun.
  ~OrderedWorker() {
    {
      const std::lock_guard<std::mutex> lock(mutex_);
      stop_ = true;
    }
    changed_.notify_all();
    thread_.join();
  }
  OrderedWorker(const OrderedWorker&) = delete;
  OrderedWorker& operator=(const OrderedWorker&) = delete;

  void push(Task task, bool is_droppable) {
    {
      const std::lock_guard<std::mutex> lock(mutex_);
      waiting_.push_back({std::move(task), is_droppable});
      num_droppable_ += is_droppable ? 1 : 0;
      if (max_droppable_ > 0 && num_droppable_ > max_droppable_) {
        dropOldest();
      }
    }
    changed_.notify_all();
  }

  uint64_t numDropped() const {
    const std::lock_guard<std::mutex> lock(mutex_);
    return num_dropped_;
  }

 private:
  struct Entry {
    Task task;
    bool is_droppable;
  };

  void dropOldest() {
    for (auto entry = waiting_.begin(); entry != waiting_.end(); ++entry) {
      if (entry->is_droppable) {
        waiting_.erase(entry);
        --num_droppable_;
        ++num_dropped_;
        return;
      }
    }
  }

  void run() {
    std::unique_lock<std::mutex> lock(mutex_);
    while (true) {
      changed_.wait(lock, [this] { return stop_ || !waiting_.empty(); });
      if (stop_) {
        return;
      }
      const Entry entry = std::move(waiting_.front());
      waiting_.pop_front();
      num_droppable_ -= entry.is_droppable ? 1 : 0;
      lock.unlock();
      work_(entry.task);
      lock.lock();
    }
  }

  const std::function<void(const Task&)> work_;
  const size_t max_droppable_;
  mutable std::mutex mutex_;
  std::condition_variable changed_;
  std::deque<Entry> waiting_;
  size_t num_droppable_ = 0;
  uint64_t num_dropped_ = 0;
  bool stop_ = false;
  std::thread thread_;
};

}  // namespace vcharge
