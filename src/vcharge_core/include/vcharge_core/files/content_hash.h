#pragma once

#include <cstddef>
#include <cstdint>
#include <memory>
#include <string>

namespace vcharge {

/// 128-bit hash (XXH3) of the content of a result, to show that two runs agree. Excludes provenance (time,
/// host).
class ContentHasher {
 public:
  ContentHasher();
  ~ContentHasher();
  ContentHasher(ContentHasher&&) noexcept;
  ContentHasher& operator=(ContentHasher&&) noexcept;

  void addBytes(const void* data, size_t size);
  void add(int64_t value) { addBytes(&value, sizeof(value)); }
  /// Adds the bit pattern, except that all NaNs are equal and -0 equals 0.
  void add(double value);
  void add(const std::string& text);

  /// 32 hexadecimal digits for everything added so far.
  std::string hex() const;

 private:
  struct State;
  std::unique_ptr<State> state_;
};

/// Hash of a whole file, which distinguishes recordings of the same name. Throws InputError if it cannot be
/// read.
std::string fileHash(const std::string& path);

}  // namespace vcharge
