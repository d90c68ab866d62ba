#include "kernels/pooled_mat.h"

#include <map>
#include <mutex>
#include <utility>
#include <vector>

namespace vcharge {
namespace {

constexpr size_t kMaxIdleBytes = size_t{96} << 20;

class MatPool : public cv::MatAllocator {
 public:
  cv::UMatData* allocate(int dims, const int* sizes, int type, void* data, size_t* step,
                         cv::AccessFlag /*flags*/, cv::UMatUsageFlags /*usage*/) const override {
    size_t bytes = CV_ELEM_SIZE(type);
    for (int i = dims - 1; i >= 0; --i) {
      if (step != nullptr) {
        step[i] = bytes;
      }
      bytes *= static_cast<size_t>(sizes[i]);
    }
    auto* header = new cv::UMatData(this);
    header->size = bytes;
    header->flags = data != nullptr ? cv::UMatData::USER_ALLOCATED : static_cast<cv::UMatData::MemoryFlag>(0);
    header->data = header->origdata = static_cast<uchar*>(data != nullptr ? data : take(bytes));
    return header;
  }
  bool allocate(cv::UMatData* data, cv::AccessFlag /*flags*/, cv::UMatUsageFlags /*usage*/) const override {
    return data != nullptr;
  }
  void deallocate(cv::UMatData* data) const override {
    if (data == nullptr) {
      return;
    }
    if ((data->flags & cv::UMatData::USER_ALLOCATED) == 0) {
      giveBack(data->origdata, data->size);
    }
    delete data;
  }

 private:
  void* take(size_t bytes) const {
    {
      const std::lock_guard<std::mutex> lock(mutex_);
      std::vector<void*>& blocks = idle_[bytes];
      if (!blocks.empty()) {
        void* block = blocks.back();
        blocks.pop_back();
        idle_bytes_ -= bytes;
        return block;
      }
    }
    return cv::fastMalloc(bytes);
  }
  void giveBack(void* block, size_t bytes) const {
    {
      const std::lock_guard<std::mutex> lock(mutex_);
      if (idle_bytes_ + bytes <= kMaxIdleBytes) {
        idle_[bytes].push_back(block);
        idle_bytes_ += bytes;
        return;
      }
    }
    cv::fastFree(block);
  }

  mutable std::mutex mutex_;
  mutable std::map<size_t, std::vector<void*>> idle_;  // unused blocks, indexed by their size
  mutable size_t idle_bytes_ = 0;
};

}  // namespace

cv::Mat pooledMat(cv::Size size, int type) {
  // Never destroyed, because matrices may live as long as the process.
  static auto* const pool = new MatPool;
  cv::Mat mat;
  mat.allocator = pool;
  mat.create(size, type);
  return mat;
}

}  // namespace vcharge
