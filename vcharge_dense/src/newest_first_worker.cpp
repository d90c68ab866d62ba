#include "newest_first_worker.h"

#include <utility>

namespace vcharge {

NewestFirstWorker::NewestFirstWorker(std::function<void(const RangeTask&)> work)
    : work_(std::move(work)), thread_([this] { run(); }) {}

NewestFirstWorker::~NewestFirstWorker() {
  {
    const std::lock_guard<std::mutex> lock(mutex_);
    stop_ = true;
  }
  changed_.notify_all();
  thread_.join();
}

void NewestFirstWorker::push(RangeTask task) {
  {
    const std::lock_guard<std::mutex> lock(mutex_);
    const size_t camera_index = task.camera_index;
    const auto inserted = waiting_.insert_or_assign(camera_index, std::move(task)).second;
    dropped_[camera_index] += inserted ? 0 : 1;
  }
  changed_.notify_all();
}

uint64_t NewestFirstWorker::numDropped(size_t camera_index) const {
  const std::lock_guard<std::mutex> lock(mutex_);
  const auto found = dropped_.find(camera_index);
  return found == dropped_.end() ? 0 : found->second;
}

void NewestFirstWorker::run() {
  std::unique_lock<std::mutex> lock(mutex_);
  while (true) {
    changed_.wait(lock, [this] { return stop_ || !waiting_.empty(); });
    if (stop_) {
      return;
    }
    auto next = waiting_.upper_bound(last_camera_);
    if (next == waiting_.end()) {
      next = waiting_.begin();
    }
    last_camera_ = next->first;
    const RangeTask task = std::move(next->second);
    waiting_.erase(next);
    lock.unlock();
    work_(task);
    lock.lock();
  }
}

}  // namespace vcharge
