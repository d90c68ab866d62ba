#pragma once

#include <memory>
#include <mutex>
#include <vector>

#include "vcharge_core/frames/image.h"

namespace vcharge {

/// Reuses the memory of images: a buffer returns to the pool with the last Image that holds it, so frames
/// need no allocation. Thread safe; images may outlive the pool.
template <class Buffer>
class BufferPool {
 public:
  /// Returns a free buffer with its old content, or a new one.
  std::shared_ptr<Buffer> acquire() {
    std::unique_ptr<Buffer> buffer;
    {
      const std::lock_guard<std::mutex> lock(state_->mutex);
      if (!state_->free.empty()) {
        buffer = std::move(state_->free.back());
        state_->free.pop_back();
      }
    }
    if (buffer == nullptr) {
      buffer = std::make_unique<Buffer>();
    }
    return std::shared_ptr<Buffer>(buffer.release(), [state = state_](Buffer* returned) {
      std::unique_ptr<Buffer> owned(returned);
      const std::lock_guard<std::mutex> lock(state->mutex);
      if (state->free.size() < kMaxFree) {
        state->free.push_back(std::move(owned));
      }
    });
  }

 private:
  static constexpr size_t kMaxFree = 64;  // enough for a burst of frames
  struct State {
    std::mutex mutex;
    std::vector<std::unique_ptr<Buffer>> free;
  };
  std::shared_ptr<State> state_ = std::make_shared<State>();
};

}  // namespace vcharge
