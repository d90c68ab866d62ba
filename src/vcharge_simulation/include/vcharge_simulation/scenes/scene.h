#pragma once

#include <cstdint>
#include <functional>
#include <limits>
#include <memory>
#include <string>
#include <vector>

#include <Eigen/Core>

#include "vcharge_core/dense_maps/parking_bay.h"
#include "vcharge_core/motion/rigid_transform.h"
#include "vcharge_core/motion/tracked_object.h"
#include "vcharge_simulation/rendering/mesh.h"
#include "vcharge_simulation/rendering/sky.h"
#include "vcharge_simulation/rendering/texture.h"
#include "vcharge_simulation/scenes/ground_height.h"

namespace vcharge {

enum class SurfaceKind : uint8_t { kGround, kKerb, kCar, kBuilding, kPlant, kPole, kOther };

/// Optical properties of a surface: diffuse reflection, Fresnel reflection of the surroundings, and
/// translucency.
struct Material {
  enum class Mapping : uint8_t { kPlain, kTexture, kGround };
  Mapping mapping = Mapping::kPlain;
  int texture = -1;     ///< index into Scene::textures (kTexture) or Scene::ground.layers (kGround)
  float albedo = 0.5F;  ///< reflectance at texture value 1
  int sun_map = -1;  ///< index into Scene::textures: fraction of the sun that reaches the surface; -1: traced
                     ///< with shadow rays
  float sun_map_texels_per_m = 1.0F;
  float texels_per_m = 100.0F;  ///< texture resolution on the surface, for the level of detail
  float reflectivity = 0.0F;    ///< at normal incidence; 0.04 for paint and glass
  float emission = 0.0F;        ///< light emitted by the surface itself
  float wetness = 0.0F;         ///< water on the ground, from 0 to 1
  float translucency = 0.0F;    ///< fraction of the light on the back that leaves through the front
  bool two_sided = false;       ///< the normal is turned towards the viewer
  SurfaceKind kind = SurfaceKind::kOther;
};

/// Textures of the ground, addressed by world x and y and shared by all ground surfaces.
struct GroundLayers {
  std::vector<GroundTexture>
      layers;  ///< reflectance divided by kGroundLayerAlbedo; each layer covers the next one
  std::vector<GroundTexture> details;  ///< fine relief that modulates the layers; 0.5 is neutral
  float detail_contrast = 0.75F;       ///< factor on the relief of the details
  float relief_m = 0.0F;  ///< height between values 0 and 1 of the first detail; shifts what is seen aslant
  std::unique_ptr<GroundTexture> sun;          ///< fraction of the sun that reaches the ground; null: all
  std::unique_ptr<GroundTexture> surrounding;  ///< fraction of the sky visible from the ground; null: all
  std::unique_ptr<GroundTexture>
      lamps;  ///< root of the irradiance from Scene::lamps over max_lamp_irradiance
  float max_lamp_irradiance = 0.0F;
};

/// Reflectance of a ground layer at texel value 255.
inline constexpr float kGroundLayerAlbedo = 0.8F;

/// A lamp that shines down and, weakly, up: a tube, or a point if half_length is zero.
struct Lamp {
  Eigen::Vector3f centre;
  Eigen::Vector3f half_length = Eigen::Vector3f::Zero();  ///< from the centre to one end
  float intensity = 1.0F;                                 ///< irradiance 1 m below the lamp
  float reach_m = 10.0F;  ///< the light fades to zero at this distance, so that distant lamps need no rays
};

/// Irradiance of a surface with this normal by a point of the lamp at `to_lamp` from it, if nothing is
/// between.
float lampIrradiance(const Lamp& lamp, const Eigen::Vector3f& to_lamp, const Eigen::Vector3f& normal);

/// Lamps of the car that carries the cameras: irradiance at 1 m in the brightest direction; 0: off.
struct VehicleLamps {
  float headlight = 0.0F, taillight = 0.0F;  ///< each of two
};

/// Ceiling of a closed scene as reflected by polished floors and car paint.
struct Ceiling {
  float height_m;
  float scale;             ///< light at texture value 1
  GroundTexture radiance;  ///< radiance of ceiling and lamps divided by `scale`
};

/// A solid object that the car must not touch.
struct Obstacle {
  std::string kind;                          ///< "car", "tree", ...
  std::vector<Eigen::Vector2d> footprint_m;  ///< polygon in the world frame, counter-clockwise
  double base_z_m = 0.0;
  double top_z_m = 0.0;
};

/// State of a mover at one time.
struct MoverState {
  RigidTransform world_from_mover;  ///< people and vehicles: on the ground in their middle, x forwards
  Eigen::Vector3d velocity_m_per_s = Eigen::Vector3d::Zero();  ///< of that origin, in the world frame
  bool is_standing = false;
  Obstacle obstacle;  ///< footprint of the mover
};

/// An object that moves through the scene. Both functions depend only on the time and must be thread safe.
struct Mover {
  std::string name;
  ObjectClass object_class = ObjectClass::kUnknown;
  std::function<MoverState(double time_s)> stateAt;
  std::function<TriangleMesh(double time_s)> meshAt;  ///< in the world frame; materials are the scene's
};

/// A static world with movers. Metres, z up.
struct Scene {
  TriangleMesh mesh;
  std::vector<Material> materials;
  std::vector<Texture> textures;
  GroundLayers ground;
  std::unique_ptr<Sky> sky;
  std::unique_ptr<Ceiling> ceiling;  ///< null: reflections show the sky
  std::vector<Lamp> lamps;           ///< lamps whose light on objects is computed when rendering
  VehicleLamps vehicle_lamps;
  std::vector<Obstacle> obstacles;  ///< static obstacles
  std::vector<ParkingBay> bays;     ///< painted ones, with the parked cars
  std::vector<Mover> movers;
  GroundHeight ground_height;  ///< height of the drivable ground
  /// Height above the ground from which objects are overhead: truth maps ignore them.
  double overhead_m = std::numeric_limits<double>::infinity();
  Eigen::Vector2d min_m{-40.0, -30.0};  ///< corners of the area that truth maps cover
  Eigen::Vector2d max_m{40.0, 30.0};

  uint32_t addMaterial(const Material& material);
  /// Adds a texture and a material that uses it; see Material for texels_per_m.
  uint32_t addTexturedMaterial(const cv::Mat& image, Texture::Border border, Material material);
};

}  // namespace vcharge
