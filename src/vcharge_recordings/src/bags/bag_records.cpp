#include "bags/bag_records.h"

#include <algorithm>
#include <filesystem>

#include "vcharge_core/base/error.h"

namespace vcharge::internal {
namespace {

constexpr size_t kPage = 4096;
// The largest field is a message's definition, of about 10 kB: a longer header has a damaged length.
constexpr uint32_t kMaxHeader = 16 << 20;

const char* nameOf(BagRecordKind kind) {
  switch (kind) {
    case BagRecordKind::kMessage:
      return "message";
    case BagRecordKind::kFileHeader:
      return "file header";
    case BagRecordKind::kIndex:
      return "index";
    case BagRecordKind::kChunk:
      return "chunk";
    case BagRecordKind::kChunkInfo:
      return "chunk info";
    default:
      return "connection";
  }
}

}  // namespace

std::string_view BagBytes::view(uint64_t offset, uint64_t size) {
  if (offset > this->size() || size > this->size() - offset) {
    fail(offset, std::to_string(size) + " bytes, got the end after " + std::to_string(this->size()));
  }
  return size == 0 ? std::string_view("") : viewInside(offset, size);  // never null: streams add to it
}

void BagBytes::fail(uint64_t offset, const std::string& expected) const {
  throw InputError(name_ + ": corrupt or truncated at byte " + std::to_string(offset) + ": expected " +
                   expected);
}

BagFile::BagFile(const std::string& path) : BagBytes(path) {
  std::error_code error;
  if (!std::filesystem::is_regular_file(path, error)) {
    throw InputError(path + ": no such file; expected a ROS bag");
  }
  // Unbuffered, since the window is the buffer.
  file_.rdbuf()->pubsetbuf(nullptr, 0);
  file_.open(path, std::ios::binary);
  size_ = std::filesystem::file_size(path, error);
  if (!file_ || error) {
    throw InputError(path + ": cannot be read; expected a ROS bag");
  }
}

std::string_view BagFile::viewInside(uint64_t offset, size_t size) {
  if (offset < window_offset_ || offset + size > window_offset_ + window_size_) {
    window_size_ = std::min<uint64_t>(std::max(size, kPage), size_ - offset);
    window_.resize(std::max(window_.size(), window_size_));
    window_offset_ = offset;
    file_.seekg(static_cast<std::streamoff>(offset));
    file_.read(window_.data(), static_cast<std::streamsize>(window_size_));
    if (!file_) {
      file_.clear();
      window_size_ = 0;
      fail(offset, std::to_string(size) + " bytes, which could not be read");
    }
  }
  return {&window_[offset - window_offset_], size};
}

BagFields::BagFields(BagBytes* bytes, uint64_t offset, uint32_t size) : source_(bytes), offset_(offset) {
  const std::string_view header = bytes->view(offset, size);
  for (size_t at = 0; at < header.size();) {
    uint32_t length = 0;
    if (header.size() - at < sizeof(length)) {
      bytes->fail(offset + at, "a field's length within its header");
    }
    std::memcpy(&length, &header[at], sizeof(length));
    at += sizeof(length);
    if (length > header.size() - at) {
      bytes->fail(offset + at, "a field within the " + std::to_string(header.size() - at) +
                                   " bytes that are left of its header, got one of " +
                                   std::to_string(length));
    }
    const std::string_view field = header.substr(at, length);
    const size_t equals = field.find('=');
    if (equals == std::string_view::npos) {
      bytes->fail(offset + at, "a field with '='");
    }
    values_[std::string(field.substr(0, equals))] = field.substr(equals + 1);
    at += length;
  }
}

const std::string& BagFields::text(const std::string& name) const {
  const auto found = values_.find(name);
  if (found == values_.end()) {
    source_->fail(offset_, "field '" + name + "' in this header");
  }
  return found->second;
}

BagRecord readBagRecord(BagBytes* bytes, uint64_t offset, uint64_t end, BagRecordKind kind) {
  const auto length_at = [&](uint64_t at, const char* of) {
    if (at > end || end - at < sizeof(uint32_t)) {
      bytes->fail(at, std::string("the length of the ") + of + " of a record (" + nameOf(kind) +
                          ") that ends by byte " + std::to_string(end));
    }
    const auto length = bytes->number<uint32_t>(at);
    const uint64_t room = end - at - sizeof(uint32_t);
    if (length > room) {
      bytes->fail(at, std::string(of) + " of at most " + std::to_string(room) + " bytes, got a length of " +
                          std::to_string(length));
    }
    return length;
  };
  const uint32_t header_size = length_at(offset, "header");
  if (header_size > kMaxHeader) {
    bytes->fail(offset, "a header of at most " + std::to_string(kMaxHeader) + " bytes, got a length of " +
                            std::to_string(header_size));
  }
  BagRecord record{BagFields(bytes, offset + 4, header_size), 0, 0};
  const auto op = record.fields.number<uint8_t>("op");
  if (op != static_cast<uint8_t>(kind)) {
    bytes->fail(offset, std::string("a record of kind ") + nameOf(kind) + " (op " +
                            std::to_string(static_cast<int>(kind)) + "), got op " + std::to_string(op));
  }
  record.data_size = length_at(offset + 4 + header_size, "data");
  record.data_offset = offset + 8 + header_size;
  return record;
}

}  // namespace vcharge::internal
