#pragma once

#include <cstddef>
#include <cstdint>

namespace vcharge {

// What bounds the plane sweep on this machine, with the instruction set that Highway currently dispatches to.

/// Gathers `rows` x `columns` 32-bit values, lane by lane along as many strips as there are lanes, as the
/// sweep reads a neighbour's image. `image` has rows of 4096 bytes and at least rows + 8 of them. Returns a
/// checksum.
int64_t gatherPixels(const int32_t* image, size_t rows, size_t columns);

/// The same with the gather as compilers emit it: on x86 each waits for the one before, whose register it
/// writes.
int64_t gatherPixelsInTurn(const int32_t* image, size_t rows, size_t columns);

/// `count` vectors of independent multiply-adds in registers; returns a checksum.
float multiplyAdd(size_t count);

/// Reads `count` floats `repetitions` times.
float readFloats(const float* values, size_t count, size_t repetitions);

/// 32-bit lanes of the instruction set.
size_t vectorLanes();

}  // namespace vcharge
