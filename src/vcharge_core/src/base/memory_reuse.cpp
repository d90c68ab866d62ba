#include "vcharge_core/base/memory_reuse.h"

#ifdef __GLIBC__
#include <malloc.h>
#endif

namespace vcharge {

void keepFreedMemory() {
#ifdef __GLIBC__
  // Larger blocks are still mapped and unmapped one by one; it is the largest threshold that is accepted.
  constexpr int kMapped_bytes = 32 << 20, kKept_bytes = 1 << 30;
  mallopt(M_MMAP_THRESHOLD, kMapped_bytes);
  mallopt(M_TRIM_THRESHOLD, kKept_bytes);
#endif
}

}  // namespace vcharge
