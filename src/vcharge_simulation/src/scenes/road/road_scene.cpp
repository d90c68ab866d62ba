#include <algorithm>
#include <cmath>

#include "lighting/lamp_light.h"
#include "scenes/lane_paths.h"
#include "scenes/lot/lot_ground.h"
#include "scenes/movers/scene_movers.h"
#include "scenes/road/road_layout.h"
#include "scenes/scene_builders.h"
#include "scenes/scene_parts.h"

namespace vcharge {

namespace {

constexpr double kGroundTexel_m = 0.02;
constexpr double kMaxGroundTexel_m = 0.5;
constexpr double kLightTexel_m = 0.08;
constexpr double kFarGround_m = 640.0;
constexpr double kFarTexel_m = 0.4;
constexpr double kWallLightTexel_m = 0.15;
constexpr double kLane_m = 1.7;

GroundTexture groundTexture(const cv::Mat& image, double min_x, double min_y, double texel_m,
                            Texture::Border border) {
  return {Texture(image, border), static_cast<float>(min_x), static_cast<float>(min_y),
          static_cast<float>(1.0 / texel_m)};
}

// The surface is bent only along x; walls carry its sides where it is raised.
void addSurface(uint32_t ground, SceneParts* parts) {
  TriangleMesh* mesh = &parts->scene().mesh;
  const std::vector<double> xs = roadStations();
  const auto at = [](double x, double y, double z) { return Eigen::Vector3d(x, y, z).cast<float>().eval(); };
  for (size_t i = 0; i + 1 < xs.size(); ++i) {
    const double a = xs[i];
    const double b = xs[i + 1];
    if (b - a < 1e-6) {
      continue;
    }
    addQuad(at(a, kRoadArea.min_y, roadHeight(a)), at(b, kRoadArea.min_y, roadHeight(b)),
            at(b, kRoadArea.max_y, roadHeight(b)), at(a, kRoadArea.max_y, roadHeight(a)), ground, mesh);
    if (std::max(roadHeight(a), roadHeight(b)) > 0.0) {
      addQuad(at(a, kRoadArea.min_y, -0.1), at(b, kRoadArea.min_y, -0.1),
              at(b, kRoadArea.min_y, roadHeight(b)), at(a, kRoadArea.min_y, roadHeight(a)), parts->concrete(),
              mesh);
      addQuad(at(b, kRoadArea.max_y, -0.1), at(a, kRoadArea.max_y, -0.1),
              at(a, kRoadArea.max_y, roadHeight(a)), at(b, kRoadArea.max_y, roadHeight(b)), parts->concrete(),
              mesh);
    }
  }
  const double end = roadHeight(kRoadArea.max_x);
  addQuad(at(kRoadArea.max_x, kRoadArea.min_y, -0.1), at(kRoadArea.max_x, kRoadArea.max_y, -0.1),
          at(kRoadArea.max_x, kRoadArea.max_y, end), at(kRoadArea.max_x, kRoadArea.min_y, end),
          parts->concrete(), mesh);
}

void addGround(const SceneOptions& options, const RoadLayout& layout, double wetness, SceneParts* parts) {
  Scene& scene = parts->scene();
  const double texel_m = std::min(kMaxGroundTexel_m, kGroundTexel_m / options.image_scale);
  Material ground;
  ground.kind = SurfaceKind::kGround;
  ground.mapping = Material::Mapping::kGround;
  ground.texture = 0;
  ground.wetness = static_cast<float>(wetness);
  const uint32_t near_ground = scene.addMaterial(ground);
  ground.wetness = 0.0F;
  ground.texture = 1;
  const uint32_t far_ground = scene.addMaterial(ground);
  scene.ground.layers.push_back(groundTexture(drawRoadGround(texel_m, options.seed), kRoadArea.min_x,
                                              kRoadArea.min_y, texel_m, Texture::Border::kClamp));
  const double far = 0.5 * kFarGround_m;
  scene.ground.layers.push_back(groundTexture(drawFarGround(-far, kFarGround_m, kFarTexel_m, options.seed),
                                              -far, -far, kFarTexel_m, Texture::Border::kClamp));
  parts->addGroundDetails(options.seed);
  addSurface(near_ground, parts);
  parts->addLevel({-far, kRoadArea.max_y, far, far}, 0.0, far_ground);
  parts->addLevel({-far, -far, far, kRoadArea.min_y}, 0.0, far_ground);
  parts->addLevel({-far, kRoadArea.min_y, kRoadArea.min_x, kRoadArea.max_y}, 0.0, far_ground);
  parts->addLevel({kRoadArea.max_x, kRoadArea.min_y, far, kRoadArea.max_y}, 0.0, far_ground);
  for (const GroundRectangle& pavement : layout.pavements) {
    parts->addIsland(pavement, near_ground);
  }
}

std::function<DrivePlan()> alongRoad(double from_x, double length_m, double speed_m_per_s) {
  return [=] {
    return DrivePlan{"", DrivePath(RigidTransform::planar(from_x, -kLane_m, 0.0), {{length_m, 0.0, 0.0}}),
                     fromRestToRest(speed_m_per_s), 0, [](double x, double) { return roadHeight(x); }};
  };
}

}  // namespace

std::shared_ptr<const Scene> buildRoadScene(const SceneOptions& options) {
  const RoadLayout layout = makeRoadLayout(options.seed, options.day);
  SceneParts parts(options.seed * 83U + 5U, options.detail, SurfaceVariety::outdoors(options.surface_seed));
  Scene& scene = parts.scene();
  const Conditions conditions = conditionsOf(options.condition);
  scene.sky = std::make_unique<Sky>(conditions.light, static_cast<uint32_t>(options.seed * 17U));
  scene.min_m = {kRoadArea.min_x, kRoadArea.min_y};
  scene.max_m = {kRoadArea.max_x, kRoadArea.max_y};
  addGround(options, layout, conditions.wetness, &parts);
  parts.addCars(layout.cars);
  parts.addTrees(layout.trees, options.seed);
  parts.addHedges(layout.hedges);
  parts.addHouses(layout.houses);
  parts.addPoles(layout.poles, conditions.pole_lamp_cd);
  scene.ground_height = [](double x, double) { return roadHeight(x); };
  bakeWallLight(parts.walls(), kWallLightTexel_m, &scene);
  const auto ground_height = [&](double x, double y) {
    const bool is_raised =
        std::any_of(layout.pavements.begin(), layout.pavements.end(),
                    [&](const GroundRectangle& pavement) { return pavement.contains(x, y); });
    return roadHeight(x) + (is_raised ? kKerbHeight_m : 0.0);
  };
  bakeGroundLight(scene.min_m, scene.max_m, kLightTexel_m / options.detail, ground_height, &scene);
  bakeGroundLamps(scene.min_m, scene.max_m, kLightTexel_m / options.detail, ground_height, &scene);
  scene.vehicle_lamps = vehicleLampsOf(conditions, kSunIlluminance_lx);
  addMovers(options,
            {{kRoadArea.min_x + 2.0, kRoadArea.min_y, kRoadLevelEnd_m, kRoadArea.max_y}, Lanes(), {}, true},
            &parts);
  return parts.sharedScene();
}

std::vector<SceneDrive> roadDrives() {
  constexpr double kStart_m = -156.0;
  return {{{"slow", "300 m straight ahead at 10 km/h"}, alongRoad(kStart_m, 300.0, 10.0 / 3.6)},
          {{"medium", "300 m straight ahead at 20 km/h"}, alongRoad(kStart_m, 300.0, 20.0 / 3.6)},
          {{"fast", "300 m straight ahead at up to 30 km/h"}, alongRoad(kStart_m, 300.0, 30.0 / 3.6)},
          {{"bumps", "over a lowered kerb and two speed bumps at 10 km/h"},
           alongRoad(kRoadLevelEnd_m, 36.0, 10.0 / 3.6)},
          {{"slope", "up a slope of 5 %"}, alongRoad(183.0, 60.0, 3.0)}};
}

}  // namespace vcharge
