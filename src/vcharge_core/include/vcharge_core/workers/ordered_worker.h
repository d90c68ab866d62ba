#pragma once

#include <cstddef>
#include <cstdint>
#include <deque>
#include <utility>

#include "vcharge_core/workers/queue_worker.h"

namespace vcharge {

/// Keeps tasks in the order of their arrival. At most max_droppable droppable tasks wait: a newer one
/// replaces the oldest, which is counted.
template <class TaskType>
class OrderedQueue {
 public:
  using Task = TaskType;

  /// With max_droppable = 0, nothing is dropped.
  explicit OrderedQueue(size_t max_droppable = 0) : max_droppable_(max_droppable) {}

  void push(Task task, bool is_droppable) {
    waiting_.push_back({std::move(task), is_droppable});
    num_droppable_ += is_droppable ? 1 : 0;
    if (max_droppable_ > 0 && num_droppable_ > max_droppable_) {
      dropOldest();
    }
  }
  bool isEmpty() const { return waiting_.empty(); }
  Task pop() {
    Entry entry = std::move(waiting_.front());
    waiting_.pop_front();
    num_droppable_ -= entry.is_droppable ? 1 : 0;
    return std::move(entry.task);
  }
  uint64_t numDropped() const { return num_dropped_; }

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

  size_t max_droppable_;
  std::deque<Entry> waiting_;
  size_t num_droppable_ = 0;
  uint64_t num_dropped_ = 0;
};

template <class Task>
using OrderedWorker = QueueWorker<OrderedQueue<Task>>;

}  // namespace vcharge
