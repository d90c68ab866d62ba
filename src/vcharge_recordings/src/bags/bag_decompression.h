#pragma once

#include <cstdint>
#include <string>
#include <string_view>
#include <vector>

namespace vcharge::internal {

/// Whether decompressChunk() supports this compression of a bag's chunks: "bz2" or "lz4".
bool isChunkCompression(const std::string& name);

/// Decompresses a chunk of `size` bytes. Memory grows with the output, not with the size claimed by a damaged
/// bag. InputError (its text continues "expected ...") for bytes that are not a valid stream (both kinds
/// have checksums) or that decompress to another number of bytes.
std::vector<char> decompressChunk(const std::string& compression, std::string_view compressed, uint32_t size);

}  // namespace vcharge::internal
