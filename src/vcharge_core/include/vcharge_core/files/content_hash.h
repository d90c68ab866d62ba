#pragma once

#include <cstddef>
#include <cstdint>
#include <memory>
#include <string>

namespace vcharge {

/// 128-bit hash (XXH3) of a result's content, to show that two runs agree. Provenance (time, host) never
/// enters it.
class ContentHasher {
 public:
  ContentHasher();
  ~ContentHasher();
  ContentHasher(ContentHasher&&) noexcept;
  ContentHasher& operator=(ContentHasher&&) noexcept;

  void addBytes(const void* data, size_t size);
  void add(int64_t value) { addBytes(&value, sizeof(value)); }
  /// By bit pattern, except that every NaN counts the same and -0 is 0.
  void add(double value);
  void add(const std::string& text);

  /// 32 hexadecimal digits of all that was added so far.
  std::string hex() const;

 private:
  struct State;
  std::unique_ptr<State> state_;
};

/// Of a whole file: tells two recordings of one name apart. InputError when it cannot be read.
std::string fileHash(const std::string& path);

}  // namespace vcharge
