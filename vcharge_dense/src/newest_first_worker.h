#pragma once

#include <condition_variable>
#include <cstdint>
#include <functional>
#include <map>
#include <mutex>
#include <thread>

#include "vcharge_dense/range_mapper.h"

namespace vcharge {

/// Works on range tasks in a thread of its own, newest first: a task that has not been begun when its camera
/// brings a newer one is dropped and counted. Cameras take turns. For live use; replay without loss calls the
/// work directly.
class NewestFirstWorker {
 public:
  /// `work` must not throw.
  explicit NewestFirstWorker(std::function<void(const RangeTask&)> work);
  /// Waits for the task in work.
  ~NewestFirstWorker();

  void push(RangeTask task);
  uint64_t numDropped(size_t camera_index) const;

 private:
  void run();

  const std::function<void(const RangeTask&)> work_;
  mutable std::mutex mutex_;
  std::condition_variable changed_;
  std::map<size_t, RangeTask> waiting_;  // by camera
  std::map<size_t, uint64_t> dropped_;
  size_t last_camera_ = 0;
  bool stop_ = false;
  std::thread thread_;
};

}  // namespace vcharge
