#pragma once

#include <cstddef>
#include <cstdint>

namespace vcharge {

/// Gathers `rows` x `columns` 32-bit values along one strip per lane, like the plane sweep reads a
/// neighbour's image: the limit of this machine for the sweep, with the instruction set that Highway
/// currently dispatches to. `image` has at least rows + 8 rows of 4096 bytes. Returns a checksum.
int64_t gatherPixels(const int32_t* image, size_t rows, size_t columns);

}  // namespace vcharge
