#pragma once

#include <map>
#include <memory>
#include <optional>
#include <utility>
#include <vector>

#include "lighting/light_baker.h"
#include "objects/plants.h"
#include "objects/surface_variety.h"
#include "scenes/scene_things.h"
#include "vcharge_simulation/objects/car_model.h"
#include "vcharge_simulation/rendering/noise.h"
#include "vcharge_simulation/scenes/scene.h"

namespace vcharge {

/// Adds objects to a scene, each with triangles, materials and obstacles. Used by the builders of all scenes.
/// Random numbers depend on the order of the calls.
class SceneParts {
 public:
  /// Creates an empty scene with the materials of plants, kerbs and metal. `foliage_density` scales the
  /// number of leaves. `surfaces` acts on what is added.
  SceneParts(uint64_t random_seed, double foliage_density, const SurfaceVariety& surfaces = SurfaceVariety());

  Scene& scene() { return *scene_; }
  const std::shared_ptr<Scene>& sharedScene() const { return scene_; }
  Random& random() { return random_; }
  const SurfaceVariety& surfaces() const { return surfaces_; }
  uint32_t metal() const { return metal_; }
  uint32_t darkMetal() const { return dark_metal_; }
  uint32_t concrete() const { return concrete_; }

  uint32_t plain(SurfaceKind kind, double albedo, double reflectivity = 0.0);
  uint32_t textured(SurfaceKind kind, const cv::Mat& image, double texels_per_m, double reflectivity = 0.0,
                    Texture::Border border = Texture::Border::kClamp);
  /// Fractal noise around `mean`, CV_8UC1.
  cv::Mat noiseImage(int width, int height, double mean, double contrast, double scale_x, double scale_y);

  /// Grain and relief of the ground.
  void addGroundDetails(uint64_t seed);
  void addLevel(const GroundRectangle& area, double z, uint32_t material);
  /// A raised area surrounded by kerb stones.
  void addIsland(const GroundRectangle& area, uint32_t ground, double base_z_m = 0.0,
                 const Kerb& kerb = Kerb());
  void addCars(const std::vector<ParkedCar>& cars);
  /// Mesh of a car in its vehicle frame, with ambient light and a number plate of its own.
  TriangleMesh carMesh(int shape, int paint, uint32_t seed);
  void addTrees(const std::vector<Tree>& trees, uint64_t seed);
  void addBushes(const std::vector<Bush>& bushes);
  void addHedges(const std::vector<Hedge>& hedges);
  /// Tufts of grass along the edge of a raised area.
  void addGrassAlong(const GroundRectangle& area, double base_z_m = 0.0, const Kerb& kerb = Kerb());
  void addHouses(const std::vector<Building>& houses);
  /// The lamps shine down with `lamp_cd`; 0: they are off.
  void addPoles(const std::vector<Pole>& poles, double lamp_cd = 0.0);
  void addBins(const std::vector<Bin>& bins);
  void addFence(const Fence& fence);
  /// Distant woods and roofs: a ring with an irregular upper edge.
  void addSkyline();
  /// Walls added by addHouses, for bakeWallLight.
  const std::vector<Wall>& walls() const { return walls_; }

 private:
  void addMaterials();
  const CarMaterials& carMaterials(int shape_index, int paint_index);

  const double foliage_density_;
  const SurfaceVariety surfaces_;
  Random random_;
  std::shared_ptr<Scene> scene_;
  PlantMaterials plants_{};
  std::vector<Wall> walls_;
  uint32_t concrete_ = 0, metal_ = 0, dark_metal_ = 0;
  std::map<std::pair<int, int>, CarMaterials> car_materials_;
  std::map<std::pair<int, int>, TriangleMesh> car_meshes_;  // with plate_marker_ on the number plates
  std::optional<uint32_t> plate_marker_;
};

}  // namespace vcharge
