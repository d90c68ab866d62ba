#pragma once

#include <cstdint>
#include <string>
#include <string_view>
#include <vector>

namespace vcharge::internal {

/// True for the compressions of a bag's chunks that decompressChunk() knows: "bz2" and "lz4".
bool isChunkCompression(const std::string& name);

/// The `size` bytes of a chunk that was compressed. Memory grows with what comes out, whatever size a damaged
/// bag claims. InputError, whose text continues "expected ...", for bytes that are no such stream (both kinds
/// have checksums) or hold another number of bytes.
std::vector<char> decompressChunk(const std::string& compression, std::string_view compressed, uint32_t size);

}  // namespace vcharge::internal
