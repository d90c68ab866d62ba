#pragma once

#include <condition_variable>
#include <functional>
#include <mutex>
#include <thread>
#include <utility>

namespace vcharge {

/// Processes the tasks of a queue one after the other in its own thread. The queue decides which task comes
/// next and which is dropped; it has a type Task, push(...), isEmpty(), pop() and numDropped(...), and is
/// only used under a lock.
template <class Queue>
class QueueWorker {
 public:
  using Task = typename Queue::Task;

  /// `work` must not throw.
  explicit QueueWorker(std::function<void(const Task&)> work, Queue queue = Queue())
      : work_(std::move(work)), queue_(std::move(queue)), thread_([this] { run(); }) {}
  /// Waits for the current task; discards those that wait.
  ~QueueWorker() {
    {
      const std::lock_guard<std::mutex> lock(mutex_);
      stop_ = true;
    }
    changed_.notify_all();
    thread_.join();
  }
  QueueWorker(const QueueWorker&) = delete;
  QueueWorker& operator=(const QueueWorker&) = delete;

  template <class... Arguments>
  void push(Arguments&&... arguments) {
    {
      const std::lock_guard<std::mutex> lock(mutex_);
      queue_.push(std::forward<Arguments>(arguments)...);
    }
    changed_.notify_all();
  }

  template <class... Arguments>
  auto numDropped(const Arguments&... arguments) const {
    const std::lock_guard<std::mutex> lock(mutex_);
    return queue_.numDropped(arguments...);
  }

 private:
  void run() {
    std::unique_lock<std::mutex> lock(mutex_);
    while (true) {
      changed_.wait(lock, [this] { return stop_ || !queue_.isEmpty(); });
      if (stop_) {
        return;
      }
      const Task task = queue_.pop();
      lock.unlock();
      work_(task);
      lock.lock();
    }
  }

  const std::function<void(const Task&)> work_;
  mutable std::mutex mutex_;
  std::condition_variable changed_;
  Queue queue_;
  bool stop_ = false;
  std::thread thread_;
};

}  // namespace vcharge
