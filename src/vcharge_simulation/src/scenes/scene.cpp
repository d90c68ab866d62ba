#include "vcharge_simulation/scenes/scene.h"

namespace vcharge {

uint32_t Scene::addMaterial(const Material& material) {
  materials.push_back(material);
  return static_cast<uint32_t>(materials.size() - 1);
}

uint32_t Scene::addTexturedMaterial(const cv::Mat& image, Texture::Border border, Material material) {
  material.mapping = Material::Mapping::kTexture;
  material.texture = static_cast<int>(textures.size());
  textures.emplace_back(image, border);
  return addMaterial(material);
}

}  // namespace vcharge
