#include "bags/bag_decompression.h"

#include <algorithm>
#include <memory>

#include <bzlib.h>
#include <lz4frame.h>

#include "vcharge_core/base/error.h"

namespace vcharge::internal {
namespace {

constexpr size_t kFirstRoom = 1 << 20;

[[noreturn]] void failAfter(const std::string& compression, size_t num_bytes, uint32_t size) {
  throw InputError("expected " + std::to_string(size) + " bytes compressed by " + compression +
                   ", got damaged ones after " + std::to_string(num_bytes));
}

/// Calls step(in, out) until it returns that the stream has ended; step advances both views.
template <class Step>
std::vector<char> decompress(const char* compression, std::string_view in, uint32_t size, Step&& step) {
  std::vector<char> out;
  size_t num_bytes = 0;
  for (bool over = false; !over;) {
    if (num_bytes == out.size() && out.size() < size) {
      out.resize(std::min<size_t>(size, std::max(kFirstRoom, 2 * out.size())));
    }
    const size_t in_before = in.size();
    char* next = out.data() + num_bytes;
    size_t room = out.size() - num_bytes;
    const size_t room_before = room;
    over = step(&in, next, &room);
    num_bytes += room_before - room;
    const bool moved = in.size() < in_before || room < room_before;
    if (!over && !moved) {
      failAfter(compression, num_bytes, size);  // cut off, or more than `size` bytes
    }
  }
  if (num_bytes != size) {
    failAfter(compression, num_bytes, size);
  }
  return out;
}

std::vector<char> decompressBz2(std::string_view compressed, uint32_t size) {
  bz_stream stream{};
  if (BZ2_bzDecompressInit(&stream, 0, 0) != BZ_OK) {
    throw std::bad_alloc();
  }
  const std::unique_ptr<bz_stream, int (*)(bz_stream*)> end(&stream, BZ2_bzDecompressEnd);
  return decompress("bz2", compressed, size, [&](std::string_view* in, char* out, size_t* room) {
    stream.next_in = const_cast<char*>(in->data());  // read only
    stream.avail_in = static_cast<unsigned>(in->size());
    stream.next_out = out;
    stream.avail_out = static_cast<unsigned>(*room);
    const int status = BZ2_bzDecompress(&stream);
    if (status != BZ_OK && status != BZ_STREAM_END) {
      throw InputError("expected bytes compressed by bz2, got damaged ones (error " + std::to_string(status) +
                       ")");
    }
    in->remove_prefix(in->size() - stream.avail_in);
    *room = stream.avail_out;
    return status == BZ_STREAM_END;
  });
}

std::vector<char> decompressLz4(std::string_view compressed, uint32_t size) {
  LZ4F_dctx* context = nullptr;
  if (LZ4F_isError(LZ4F_createDecompressionContext(&context, LZ4F_VERSION)) != 0) {
    throw std::bad_alloc();
  }
  const std::unique_ptr<LZ4F_dctx, LZ4F_errorCode_t (*)(LZ4F_dctx*)> end(context,
                                                                         LZ4F_freeDecompressionContext);
  return decompress("lz4", compressed, size, [&](std::string_view* in, char* out, size_t* room) {
    size_t num_in = in->size(), num_out = *room;
    const size_t status = LZ4F_decompress(context, out, &num_out, in->data(), &num_in, nullptr);
    if (LZ4F_isError(status) != 0) {
      throw InputError(std::string("expected bytes compressed by lz4, got damaged ones (") +
                       LZ4F_getErrorName(status) + ")");
    }
    in->remove_prefix(num_in);
    *room -= num_out;
    return status == 0;
  });
}

}  // namespace

bool isChunkCompression(const std::string& name) {
  return name == "bz2" || name == "lz4";
}

std::vector<char> decompressChunk(const std::string& compression, std::string_view compressed,
                                  uint32_t size) {
  return compression == "bz2" ? decompressBz2(compressed, size) : decompressLz4(compressed, size);
}

}  // namespace vcharge::internal
