#pragma once

#include <cstddef>
#include <cstdint>
#include <map>
#include <utility>

#include "vcharge_core/workers/queue_worker.h"

namespace vcharge {

/// Keeps the newest task of each channel (for example, a camera): a waiting task is dropped and counted when
/// its channel brings a newer one. Channels take turns.
template <class TaskType>
class NewestFirstQueue {
 public:
  using Task = TaskType;

  void push(size_t channel, Task task) {
    const bool is_first = waiting_.insert_or_assign(channel, std::move(task)).second;
    dropped_[channel] += is_first ? 0 : 1;
  }
  bool isEmpty() const { return waiting_.empty(); }
  Task pop() {
    auto next = waiting_.upper_bound(last_channel_);
    if (next == waiting_.end()) {
      next = waiting_.begin();
    }
    last_channel_ = next->first;
    Task task = std::move(next->second);
    waiting_.erase(next);
    return task;
  }
  uint64_t numDropped(size_t channel) const {
    const auto found = dropped_.find(channel);
    return found == dropped_.end() ? 0 : found->second;
  }

 private:
  std::map<size_t, Task> waiting_;
  std::map<size_t, uint64_t> dropped_;
  size_t last_channel_ = 0;
};

/// For live use; lossless replay calls the work directly.
template <class Task>
using NewestFirstWorker = QueueWorker<NewestFirstQueue<Task>>;

}  // namespace vcharge
