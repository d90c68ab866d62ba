#pragma once

#include <memory>
#include <mutex>
#include <vector>

#include "vcharge_core/frames/image.h"

namespace vcharge {

/// Gives out memory for images and takes it back when the last Image that holds it is gone, so that no frame
/// costs an allocation. Thread safe; images may outlive the pool.
template <class Buffer>
class BufferPool {
 public:
  /// A buffer that nobody holds, as it was left, or a new one.
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
  static constexpr size_t kMaxFree = 64;  // a burst's worth
  struct State {
    std::mutex mutex;
    std::vector<std::unique_ptr<Buffer>> free;
  };
  std::shared_ptr<State> state_ = std::make_shared<State>();
};

}  // namespace vcharge
