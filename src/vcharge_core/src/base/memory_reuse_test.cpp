#include "vcharge_core/base/memory_reuse.h"

#include <sys/resource.h>

#include <cstddef>
#include <vector>

#include <gtest/gtest.h>

namespace vcharge {
namespace {

// Sanitizers have an allocator of their own.
#if !defined(__SANITIZE_ADDRESS__) && !defined(__SANITIZE_THREAD__)

long numPageFaults() {
  rusage usage{};
  getrusage(RUSAGE_SELF, &usage);
  return usage.ru_minflt;
}

TEST(MemoryReuseTest, FreedBlocksAreNotReturnedToTheSystem) {
  constexpr size_t kBytes = 8 << 20, kPage_bytes = 4096;
  keepFreedMemory();
  ASSERT_EQ(std::vector<char>(kBytes, 1).back(), 1);  // the heap grows once
  const long before = numPageFaults();
  for (int i = 0; i < 10; ++i) {
    const std::vector<char> block(kBytes, static_cast<char>(i));
    ASSERT_EQ(block.back(), i);
  }
  EXPECT_LT(numPageFaults() - before, static_cast<long>(kBytes / kPage_bytes));
}
#endif

}  // namespace
}  // namespace vcharge
