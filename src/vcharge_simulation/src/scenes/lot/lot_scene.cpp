#include "scenes/lot/lot_variant.h"

#include <algorithm>

#include "lighting/lamp_light.h"
#include "lighting/light_baker.h"
#include "scenes/lot/lot_ground.h"
#include "scenes/lot/lot_layout.h"
#include "scenes/movers/scene_movers.h"
#include "scenes/scene_builders.h"
#include "scenes/scene_parts.h"

namespace vcharge {

namespace {

constexpr double kGroundTexel_m = 0.0125;
constexpr double kMaxGroundTexel_m = 0.5;
constexpr double kLightTexel_m = 0.05;  // edge length of a texel of the baked shadows
constexpr double kFarGround_m = 280.0;
constexpr double kFarTexel_m = 0.2;
constexpr double kWallLightTexel_m = 0.12;

LightOptions lightOfDay(int day) {
  LightOptions light;
  if (day != 0) {
    light.sun_azimuth_rad = 2.2 + 1.9 * day;
    light.sun_elevation_rad = 0.55;
    light.sun_irradiance = 0.8;
    light.sky_irradiance = 0.5;
    light.cloud_cover = 0.65;
  }
  return light;
}

// Builds one lot; each step adds to the scene.
class LotBuilder {
 public:
  LotBuilder(const SceneOptions& options, const LotVariant& variant)
      : options_(options),
        variant_(variant),
        layout_(variant.layout),
        conditions_(conditionsOf(options.condition, lightOfDay(options.day.number))),
        parts_(options.seed * 77U + 1U, options.detail, SurfaceVariety::outdoors(options.surface_seed)) {}

  std::shared_ptr<const Scene> build() {
    scene().sky = std::make_unique<Sky>(
        conditions_.light,
        static_cast<uint32_t>(options_.seed * 13U + static_cast<uint64_t>(options_.day.number)));
    addGround();
    parts_.addCars(layout_.cars);
    parts_.addTrees(layout_.trees, options_.seed);
    parts_.addBushes(layout_.bushes);
    parts_.addHedges(layout_.hedges);
    for (const GroundRectangle& island : layout_.islands) {
      parts_.addGrassAlong(island, levelOf(island), layout_.kerb);
    }
    addGardenWalls();
    parts_.addHouses(layout_.buildings);
    parts_.addPoles(layout_.poles, conditions_.pole_lamp_cd);
    parts_.addBins(layout_.bins);
    for (const Fence& fence : layout_.fences) {
      parts_.addFence(fence);
    }
    parts_.addSkyline();
    scene().ground_height = variant_.ground_height;
    if (variant_.add_things) {
      variant_.add_things(&parts_);
    }
    bakeWallLight(parts_.walls(), kWallLightTexel_m, &scene());
    const auto ground_height = [&](double x, double y) {
      return layout_.groundHeight(x, y) + (variant_.ground_height ? variant_.ground_height(x, y) : 0.0);
    };
    const Eigen::Vector2d corner_m(44.0, 34.0);
    bakeGroundLight(-corner_m, corner_m, kLightTexel_m / options_.detail, ground_height, &scene());
    bakeGroundLamps(-corner_m, corner_m, kLightTexel_m / options_.detail, ground_height, &scene());
    scene().vehicle_lamps = vehicleLampsOf(conditions_, kSunIlluminance_lx);
    scene().bays = paintedBays(layout_.bays, layout_.cars);
    addMovers(options_, {kLotArea, layout_.lanes, baysToLeave(layout_.bays)}, &parts_);
    return parts_.sharedScene();
  }

 private:
  Scene& scene() { return parts_.scene(); }

  double levelOf(const GroundRectangle& island) const {
    return variant_.ground_height ? variant_.ground_height(0.5 * (island.min_x + island.max_x),
                                                           0.5 * (island.min_y + island.max_y))
                                  : 0.0;
  }

  void addGardenWalls() {
    for (const GardenWall& wall : layout_.garden_walls) {
      const GroundRectangle& area = wall.area;
      const uint32_t plaster = parts_.textured(
          SurfaceKind::kBuilding,
          parts_.noiseImage(1024, 128, parts_.random().uniform(0.25, 0.6), 0.15, 0.02, 0.03), 30.0);
      addBox(
          placement(0.5 * (area.min_x + area.max_x), 0.5 * (area.min_y + area.max_y), 0.5 * wall.height, 0.0),
          Eigen::Vector3d(area.width(), area.depth(), wall.height).cast<float>(), plaster, &scene().mesh);
      scene().obstacles.push_back(obstacleOf(wall));
    }
  }

  void addGround() {
    const double texel_m = std::min(kMaxGroundTexel_m, kGroundTexel_m / options_.image_scale);
    Material ground;
    ground.kind = SurfaceKind::kGround;
    ground.mapping = Material::Mapping::kGround;
    ground.texture = 0;
    const uint32_t island_ground = scene().addMaterial(ground);
    ground.wetness = static_cast<float>(conditions_.wetness);
    const uint32_t near_ground = conditions_.wetness > 0.0 ? scene().addMaterial(ground) : island_ground;
    ground.wetness = 0.0F;
    ground.texture = 1;
    const uint32_t far_ground = scene().addMaterial(ground);
    cv::Mat lot_ground = drawLotGround(layout_, texel_m, options_.seed);
    parts_.surfaces().fade(1.0 / texel_m, &lot_ground);
    scene().ground.layers.push_back({Texture(lot_ground, Texture::Border::kClamp),
                                     static_cast<float>(kLotArea.min_x), static_cast<float>(kLotArea.min_y),
                                     static_cast<float>(1.0 / texel_m)});
    scene().ground.layers.push_back(
        {Texture(drawFarGround(-0.5 * kFarGround_m, kFarGround_m, kFarTexel_m, options_.seed),
                 Texture::Border::kClamp),
         static_cast<float>(-0.5 * kFarGround_m), static_cast<float>(-0.5 * kFarGround_m),
         static_cast<float>(1.0 / kFarTexel_m)});
    parts_.addGroundDetails(options_.seed);
    if (variant_.add_ground) {
      variant_.add_ground(near_ground, &parts_);
    } else {
      parts_.addLevel(kLotArea, 0.0, near_ground);
    }
    const double far = 0.5 * kFarGround_m;
    parts_.addLevel({-far, kLotArea.max_y, far, far}, 0.0, far_ground);
    parts_.addLevel({-far, -far, far, kLotArea.min_y}, 0.0, far_ground);
    parts_.addLevel({-far, kLotArea.min_y, kLotArea.min_x, kLotArea.max_y}, 0.0, far_ground);
    parts_.addLevel({kLotArea.max_x, kLotArea.min_y, far, kLotArea.max_y}, 0.0, far_ground);
    for (const GroundRectangle& island : layout_.islands) {
      parts_.addIsland(island, island_ground, levelOf(island), layout_.kerb);
    }
  }

  const SceneOptions options_;
  const LotVariant& variant_;
  const LotLayout& layout_;
  const Conditions conditions_;
  SceneParts parts_;
};

}  // namespace

std::shared_ptr<const Scene> buildLotVariant(const SceneOptions& options, const LotVariant& variant) {
  return LotBuilder(options, variant).build();
}

std::shared_ptr<const Scene> buildLotScene(const SceneOptions& options) {
  LotVariant lot;
  lot.layout = makeLotLayout(options.seed, options.day, options.layout_seed);
  return buildLotVariant(options, lot);
}

}  // namespace vcharge
