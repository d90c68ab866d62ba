#pragma once

namespace vcharge {

/// Makes the allocator of the process keep memory that is freed, for the next allocation. Stages allocate
/// images and grids of the same sizes for every frame; the defaults of the C library return them to the
/// system each time, and zeroing their pages anew takes most of the time of a stage with many of them.
/// The process keeps its peak of memory. Does nothing if the C library has no such setting.
void keepFreedMemory();

}  // namespace vcharge
