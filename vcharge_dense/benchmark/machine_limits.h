#pragma once

#include <cstddef>
#include <cstdint>

namespace vcharge {

// Limits of this machine for the plane sweep, with the instruction set that Highway currently dispatches to.

/// Gathers `rows` x `columns` 32-bit values along one strip per lane, like the sweep reads a neighbour's
/// image. `image` has at least rows + 8 rows of 4096 bytes. Returns a checksum.
int64_t gatherPixels(const int32_t* image, size_t rows, size_t columns);

/// The same with the gather as compilers emit it: on x86 each one waits for the previous one, whose register
/// it overwrites.
int64_t gatherPixelsInTurn(const int32_t* image, size_t rows, size_t columns);

/// `count` vectors of independent multiply-adds in registers; returns a checksum.
float multiplyAdd(size_t count);

/// Reads `count` floats `repetitions` times.
float readFloats(const float* values, size_t count, size_t repetitions);

/// 32-bit lanes of the instruction set.
size_t vectorLanes();

}  // namespace vcharge
