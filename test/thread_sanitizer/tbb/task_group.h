#pragma once

#include <exception>
#include <mutex>
#include <thread>
#include <utility>
#include <vector>

// A replacement for oneTBB that ThreadSanitizer understands, see ../README.md.
namespace tbb {

/// Runs every task in a separate thread.
class task_group {
 public:
  ~task_group() { join(); }

  template <class Task>
  void run(Task task) {
    threads_.emplace_back([this, task = std::move(task)] {
      try {
        task();
      } catch (...) {
        const std::lock_guard<std::mutex> lock(mutex_);
        error_ = std::current_exception();
      }
    });
  }

  void wait() {
    join();
    if (error_) {
      std::rethrow_exception(std::exchange(error_, nullptr));
    }
  }

 private:
  void join() {
    for (std::thread& thread : threads_) {
      thread.join();
    }
    threads_.clear();
  }

  std::vector<std::thread> threads_;
  std::mutex mutex_;
  std::exception_ptr error_;
};

}  // namespace tbb
