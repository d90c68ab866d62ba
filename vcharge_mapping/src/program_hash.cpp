#include "program_hash.h"

#include <link.h>

#include <cerrno>
#include <filesystem>
#include <fstream>
#include <map>
#include <system_error>
#include <vector>

#include "vcharge_core/content_hash.h"
#include "vcharge_core/error.h"

namespace vcharge {

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

std::string programHash() {
  std::map<std::string, std::string> paths{{"", "/proc/self/exe"}};  // by file name, wherever they lie
  dl_iterate_phdr(
      [](dl_phdr_info* info, size_t /*size*/, void* data) {
        const std::string path = info->dlpi_name;
        const std::string name = path.substr(path.rfind('/') + 1);
        if (name.rfind("libvcharge_", 0) == 0) {
          (*static_cast<std::map<std::string, std::string>*>(data))[name] = path;
        }
        return 0;
      },
      &paths);
  ContentHasher hasher;
  for (const auto& [name, path] : paths) {
    hasher.add(name);
    hasher.add(fileHash(path));
  }
  return hasher.hex();
}

}  // namespace vcharge
