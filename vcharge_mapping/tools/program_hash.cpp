#include "program_hash.h"

#include <link.h>

#include <map>
#include <string>

#include "vcharge_core/files/content_hash.h"

namespace vcharge {

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
