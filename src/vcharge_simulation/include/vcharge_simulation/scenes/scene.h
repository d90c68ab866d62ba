#pragma once

#include <cstdint>
#include <functional>
#include <limits>
#include <memory>
#include <string>
#include <vector>

#include <Eigen/Core>

#include "vcharge_core/motion/rigid_transform.h"
#include "vcharge_simulation/rendering/mesh.h"
#include "vcharge_simulation/rendering/sky.h"
#include "vcharge_simulation/rendering/texture.h"
#include "vcharge_simulation/scenes/ground_height.h"

namespace vcharge {

enum class SurfaceKind : uint8_t { kGround, kKerb, kCar, kBuilding, kPlant, kPole, kOther };

/// How a surface answers light: a diffuse part, a Fresnel reflection of the surroundings, and light through
/// leaves.
struct Material {
  enum class Mapping : uint8_t { kPlain, kTexture, kGround };
  Mapping mapping = Mapping::kPlain;
  int texture = -1;     ///< into Scene::textures (kTexture) or Scene::ground.layers (kGround)
  float albedo = 0.5F;  ///< reflectance where the texture is 1
  int sun_map = -1;     ///< into Scene::textures: share of the sun that reaches the surface; -1: traced
  float sun_map_texels_per_m = 1.0F;
  float texels_per_m = 100.0F;  ///< of the texture on the surface, for the level of detail
  float reflectivity = 0.0F;    ///< at normal incidence; 0.04 for paint and glass
  float emission = 0.0F;        ///< light that the surface sends of its own
  float translucency = 0.0F;    ///< share of the light on the back that leaves through the front
  bool two_sided = false;       ///< normals turn to the viewer
  SurfaceKind kind = SurfaceKind::kOther;
};

/// Textures on the ground plane, shared by all level surfaces.
struct GroundLayers {
  std::vector<GroundTexture> layers;   ///< reflectance over 0.8; each covers the one after it
  std::vector<GroundTexture> details;  ///< fine relief on top of the layers: 0.5 leaves them as they are
  std::unique_ptr<GroundTexture> sun;  ///< share of the sun that reaches the ground; absent: all
  std::unique_ptr<GroundTexture> surrounding;  ///< share of the sky that the ground sees; absent: all
};

/// Reflectance of a ground layer's texel value 255.
inline constexpr float kGroundLayerAlbedo = 0.8F;

/// What polished floors and car paint mirror of a closed scene above them.
struct Ceiling {
  float height_m;
  float scale;             ///< light of the texture's value 1
  GroundTexture radiance;  ///< of ceiling and lamps, over scale
};

/// A solid thing that a car must not touch.
struct Obstacle {
  std::string kind;                          ///< "car", "tree", ...
  std::vector<Eigen::Vector2d> footprint_m;  ///< polygon in the world frame, counter-clockwise
  double base_z_m = 0.0;
  double top_z_m = 0.0;
};

/// A mover as it is at one time.
struct MoverState {
  TriangleMesh mesh;  ///< in the world frame; materials are the scene's
  RigidTransform world_from_mover;
  Obstacle obstacle;  ///< the ground that it takes
};

/// A thing that moves through the scene, by a formula of the time: `stateAt` is thread safe.
struct Mover {
  std::string name;
  std::function<MoverState(double time_s)> stateAt;
};

/// A world that stands still but for its movers: metres, z up.
struct Scene {
  TriangleMesh mesh;
  std::vector<Material> materials;
  std::vector<Texture> textures;
  GroundLayers ground;
  std::unique_ptr<Sky> sky;
  std::unique_ptr<Ceiling> ceiling;  ///< absent: reflections see the sky
  std::vector<Obstacle> obstacles;   ///< that stand still
  std::vector<Mover> movers;
  GroundHeight ground_height;  ///< of the drivable ground
  /// Height above the ground from which on things hang overhead: truth maps look through them.
  double overhead_m = std::numeric_limits<double>::infinity();
  Eigen::Vector2d min_m{-40.0, -30.0};  ///< corners of the area that truth maps cover
  Eigen::Vector2d max_m{40.0, 30.0};

  uint32_t addMaterial(const Material& material);
  /// Adds a texture with its material. texels_per_m: see Material.
  uint32_t addTexturedMaterial(const cv::Mat& image, Texture::Border border, Material material);
};

}  // namespace vcharge
