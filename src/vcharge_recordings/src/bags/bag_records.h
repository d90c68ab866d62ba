#pragma once

#include <cstdint>
#include <cstring>
#include <fstream>
#include <map>
#include <string>
#include <string_view>
#include <vector>

namespace vcharge::internal {

/// Bytes from which records are read: the bag's file, or one of its chunks after decompression.
class BagBytes {
 public:
  virtual ~BagBytes() = default;
  virtual uint64_t size() const = 0;
  /// The bytes [offset, offset + size), valid until the next call. InputError beyond the end.
  std::string_view view(uint64_t offset, uint64_t size);
  /// Reads a little-endian number.
  template <class Number>
  Number number(uint64_t offset) {
    Number value;
    std::memcpy(&value, view(offset, sizeof(value)).data(), sizeof(value));
    return value;
  }
  /// Throws InputError "<name>: corrupt or truncated at byte <offset>: expected <expected>".
  [[noreturn]] void fail(uint64_t offset, const std::string& expected) const;

 protected:
  explicit BagBytes(std::string name) : name_(std::move(name)) {}

 private:
  virtual std::string_view viewInside(uint64_t offset, size_t size) = 0;

  const std::string name_;
};

/// The file of a bag. Only the bytes that were read last, or one page, are in memory.
class BagFile : public BagBytes {
 public:
  /// InputError if there is no such file.
  explicit BagFile(const std::string& path);
  uint64_t size() const override { return size_; }

 private:
  std::string_view viewInside(uint64_t offset, size_t size) override;

  std::ifstream file_;
  uint64_t size_ = 0;
  std::vector<char> window_;
  uint64_t window_offset_ = 0;
  size_t window_size_ = 0;
};

/// A chunk after decompression.
class BagChunkBytes : public BagBytes {
 public:
  BagChunkBytes(std::string name, std::vector<char> bytes)
      : BagBytes(std::move(name)), bytes_(std::move(bytes)) {}
  uint64_t size() const override { return bytes_.size(); }

 private:
  std::string_view viewInside(uint64_t offset, size_t size) override { return {&bytes_[offset], size}; }

  const std::vector<char> bytes_;
};

/// The fields "name=value" of a record's header, or of a connection's. InputError for a field that does not
/// end within the header or has no '='.
class BagFields {
 public:
  BagFields(BagBytes* bytes, uint64_t offset, uint32_t size);

  /// A field of exactly that many bytes; InputError if it is missing or has another size.
  template <class Number>
  Number number(const std::string& name) const {
    const std::string& value = text(name);
    if (value.size() != sizeof(Number)) {
      source_->fail(offset_, "field '" + name + "' of " + std::to_string(sizeof(Number)) + " bytes, got " +
                                 std::to_string(value.size()));
    }
    Number number;
    std::memcpy(&number, value.data(), sizeof(number));
    return number;
  }
  /// InputError if it is missing.
  const std::string& text(const std::string& name) const;
  bool has(const std::string& name) const { return values_.count(name) > 0; }

 private:
  const BagBytes* source_;
  uint64_t offset_;
  std::map<std::string, std::string> values_;
};

/// Kind of a record, from its field "op".
enum class BagRecordKind : uint8_t {
  kMessage = 2,
  kFileHeader = 3,
  kIndex = 4,
  kChunk = 5,
  kChunkInfo = 6,
  kConnection = 7
};

/// A record: its fields, and the position of its data.
struct BagRecord {
  BagFields fields;
  uint64_t data_offset;
  uint32_t data_size;
  uint64_t end() const { return data_offset + data_size; }
};

/// The record at `offset`, which must end at or before `end`. InputError if it does not, or is of another
/// kind.
BagRecord readBagRecord(BagBytes* bytes, uint64_t offset, uint64_t end, BagRecordKind kind);

}  // namespace vcharge::internal
