#include "sparse_map/sparse_map_schema.h"

#include "vcharge_core/files/content_hash.h"

namespace vcharge::map_file {

std::string attachmentsHash(const std::string& rig_text, const std::vector<std::string>& mask_files,
                            const std::vector<std::vector<uint8_t>>& mask_pngs,
                            const MapProvenance& provenance) {
  ContentHasher hasher;
  hasher.add(rig_text);
  for (const std::string& mask_file : mask_files) {
    hasher.add(mask_file);
  }
  for (const std::vector<uint8_t>& png : mask_pngs) {
    hasher.add(static_cast<int64_t>(png.size()));
    hasher.addBytes(png.data(), png.size());
  }
  for (const auto& [key, value] : provenance) {
    hasher.add(key);
    hasher.add(value);
  }
  return hasher.hex();
}

}  // namespace vcharge::map_file
