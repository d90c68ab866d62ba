#pragma once

#include <functional>
#include <memory>
#include <utility>

#include "vcharge_core/workers/newest_first_worker.h"

namespace vcharge {

/// Runs work of a nodelet that may take longer than the time between messages in its own thread: the newest
/// task of each channel (a camera) first; older ones are dropped and counted. In a replay without loss, the
/// work is done at once in the caller's thread.
template <class Task>
class LiveQueue {
 public:
  /// `work` must not throw.
  LiveQueue(bool is_lossless, std::function<void(const Task&)> work)
      : work_(std::move(work)),
        worker_(is_lossless ? nullptr : std::make_unique<NewestFirstWorker<Task>>(work_)) {}

  void push(size_t channel, Task task) {
    if (worker_) {
      worker_->push(channel, std::move(task));
    } else {
      work_(task);
    }
  }
  uint64_t numDropped(size_t channel) const { return worker_ ? worker_->numDropped(channel) : 0; }

 private:
  const std::function<void(const Task&)> work_;
  const std::unique_ptr<NewestFirstWorker<Task>> worker_;
};

}  // namespace vcharge
