#include "vcharge_core/files/content_hash.h"

#include <cerrno>
#include <cmath>
#include <cstring>
#include <filesystem>
#include <fstream>
#include <limits>
#include <new>
#include <system_error>
#include <vector>

#include <xxhash.h>

#include "vcharge_core/base/error.h"

namespace vcharge {

struct ContentHasher::State {
  State() : xxh3(XXH3_createState()) {
    if (xxh3 == nullptr) {
      throw std::bad_alloc();
    }
    XXH3_128bits_reset(xxh3);
  }
  ~State() { XXH3_freeState(xxh3); }
  State(const State&) = delete;
  State& operator=(const State&) = delete;
  XXH3_state_t* xxh3;
};

ContentHasher::ContentHasher() : state_(std::make_unique<State>()) {}
ContentHasher::~ContentHasher() = default;
ContentHasher::ContentHasher(ContentHasher&&) noexcept = default;
ContentHasher& ContentHasher::operator=(ContentHasher&&) noexcept = default;

void ContentHasher::addBytes(const void* data, size_t size) {
  XXH3_128bits_update(state_->xxh3, data, size);
}

void ContentHasher::add(double value) {
  if (std::isnan(value)) {
    value = std::numeric_limits<double>::quiet_NaN();
  } else if (value == 0.0) {
    value = 0.0;
  }
  addBytes(&value, sizeof(value));
}

void ContentHasher::add(const std::string& text) {
  add(static_cast<int64_t>(text.size()));
  addBytes(text.data(), text.size());
}

std::string ContentHasher::hex() const {
  XXH128_canonical_t canonical;
  XXH128_canonicalFromHash(&canonical, XXH3_128bits_digest(state_->xxh3));
  static const char* const kDigits = "0123456789abcdef";
  std::string text;
  for (const unsigned char byte : canonical.digest) {
    text.push_back(kDigits[byte >> 4]);
    text.push_back(kDigits[byte & 15]);
  }
  return text;
}

std::string fileHash(const std::string& path) {
  if (!std::filesystem::exists(path)) {
    throw InputError(path + ": no such file");
  }
  std::ifstream file(path, std::ios::binary);
  if (!file) {
    throw InputError(path + ": cannot be read: " + std::generic_category().message(errno));
  }
  ContentHasher hasher;
  std::vector<char> buffer(1 << 20);
  while (file.read(buffer.data(), static_cast<std::streamsize>(buffer.size())) || file.gcount() > 0) {
    hasher.addBytes(buffer.data(), static_cast<size_t>(file.gcount()));
  }
  return hasher.hex();
}

}  // namespace vcharge
