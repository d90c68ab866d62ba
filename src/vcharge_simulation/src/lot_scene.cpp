#include "vcharge_simulation/lot_scene.h"

#include <array>
#include <cmath>
#include <map>
#include <string>
#include <utility>

#include "facade.h"
#include "light_baker.h"
#include "lot_ground.h"
#include "lot_layout.h"
#include "plants.h"
#include "vcharge_core/options.h"
#include "vcharge_simulation/car_model.h"
#include "vcharge_simulation/noise.h"

namespace vcharge {

namespace {

constexpr double kPi = 3.14159265358979323846;
constexpr double kLotLeaf_m = 0.12;
constexpr double kTallTreeLeaf_m = 0.17;  // times the tree's scale
constexpr double kFarGround_m = 280.0;
constexpr double kFarTexel_m = 0.2;
constexpr double kWallLightTexel_m = 0.12;
constexpr double kDetailTexel_m = 0.0035;
constexpr std::array<double, 5> kPaints = {0.025, 0.07, 0.18, 0.4, 0.72};

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

std::vector<Eigen::Vector2d> orientedRectangle(double x, double y, double yaw_rad, double min_along,
                                               double max_along, double half_width) {
  const Eigen::Vector2d along(std::cos(yaw_rad), std::sin(yaw_rad));
  const Eigen::Vector2d across(-along.y(), along.x());
  const Eigen::Vector2d origin(x, y);
  return {origin + min_along * along - half_width * across, origin + max_along * along - half_width * across,
          origin + max_along * along + half_width * across, origin + min_along * along + half_width * across};
}

std::vector<Eigen::Vector2d> circle(double x, double y, double radius) {
  std::vector<Eigen::Vector2d> points;
  constexpr int kCorners = 10;
  for (int i = 0; i < kCorners; ++i) {
    const double angle = 2.0 * kPi * i / kCorners;
    points.emplace_back(x + radius * std::cos(angle), y + radius * std::sin(angle));
  }
  return points;
}

std::vector<Eigen::Vector2d> corners(const GroundRectangle& area) {
  return {
      {area.min_x, area.min_y}, {area.max_x, area.min_y}, {area.max_x, area.max_y}, {area.min_x, area.max_y}};
}

// Builds one lot; each step adds to the scene.
class LotBuilder {
 public:
  explicit LotBuilder(const LotOptions& options)
      : options_(options),
        layout_(makeLotLayout(options.seed, options.day, options.moved_cars)),
        random_(options.seed * 77U + 1U),
        scene_(std::make_shared<Scene>()) {}

  std::shared_ptr<const Scene> build() {
    scene_->sky = std::make_unique<Sky>(
        lightOfDay(options_.day),
        static_cast<uint32_t>(options_.seed * 13U + static_cast<uint64_t>(options_.day)));
    addMaterials();
    addGround();
    addCars();
    addPlants();
    addHouses();
    addFurniture();
    addSkyline();
    bakeWallLight(walls_, kWallLightTexel_m, scene_.get());
    bakeGroundLight(
        {-44.0, -34.0}, {44.0, 34.0}, options_.light_texel_m,
        [&](double x, double y) { return layout_.groundHeight(x, y); }, scene_.get());
    return scene_;
  }

 private:
  uint32_t plain(SurfaceKind kind, double albedo, double reflectivity = 0.0) {
    Material material;
    material.kind = kind;
    material.albedo = static_cast<float>(albedo);
    material.reflectivity = static_cast<float>(reflectivity);
    return scene_->addMaterial(material);
  }

  uint32_t textured(SurfaceKind kind, const cv::Mat& image, double texels_per_m, double reflectivity = 0.0,
                    Texture::Border border = Texture::Border::kClamp) {
    Material material;
    material.kind = kind;
    material.albedo = 1.0F;
    material.texels_per_m = static_cast<float>(texels_per_m);
    material.reflectivity = static_cast<float>(reflectivity);
    return scene_->addTexturedMaterial(image, border, material);
  }

  cv::Mat noiseImage(int width, int height, double mean, double contrast, double scale_x, double scale_y) {
    const auto seed = static_cast<uint32_t>(random_.bits());
    cv::Mat image(height, width, CV_8UC1);
    for (int y = 0; y < height; ++y) {
      for (int x = 0; x < width; ++x) {
        const float noise =
            fractalNoise(static_cast<float>(x * scale_x), static_cast<float>(y * scale_y), 4, 0.75F, seed);
        image.at<uint8_t>(y, x) = cv::saturate_cast<uint8_t>(255.0 * mean * (1.0 + contrast * noise));
      }
    }
    return image;
  }

  void addMaterials() {
    plants_.bark = textured(SurfaceKind::kPlant, noiseImage(128, 256, 0.14, 0.5, 0.25, 0.06), 150.0);
    Material leaves;
    leaves.kind = SurfaceKind::kPlant;
    leaves.two_sided = true;
    leaves.translucency = 0.35F;
    // One tone per leaf: u is random, and the level of detail must not average the tones.
    leaves.texels_per_m = 0.0F;
    cv::Mat tones(1, 64, CV_8UC1);
    for (int i = 0; i < tones.cols; ++i) {
      tones.at<uint8_t>(0, i) = cv::saturate_cast<uint8_t>(90.0 + 165.0 * i / (tones.cols - 1));
    }
    leaves.albedo = 0.22F;
    plants_.leaves = scene_->addTexturedMaterial(tones, Texture::Border::kClamp, leaves);
    plants_.dark_core = plain(SurfaceKind::kPlant, 0.02);
    concrete_ = textured(SurfaceKind::kKerb, noiseImage(512, 32, 0.36, 0.22, 0.07, 0.12), 100.0);
    metal_ = plain(SurfaceKind::kPole, 0.25, 0.05);
    dark_metal_ = plain(SurfaceKind::kPole, 0.06, 0.04);
  }

  void addGround() {
    Material ground;
    ground.kind = SurfaceKind::kGround;
    ground.mapping = Material::Mapping::kGround;
    ground.texture = 0;
    const uint32_t near_ground = scene_->addMaterial(ground);
    ground.texture = 1;
    const uint32_t far_ground = scene_->addMaterial(ground);
    scene_->ground.layers.push_back(
        {Texture(drawLotGround(layout_, options_.ground_texel_m, options_.seed), Texture::Border::kClamp),
         static_cast<float>(kLotArea.min_x), static_cast<float>(kLotArea.min_y),
         static_cast<float>(1.0 / options_.ground_texel_m)});
    scene_->ground.layers.push_back(
        {Texture(drawFarGround(-0.5 * kFarGround_m, kFarGround_m, kFarTexel_m, options_.seed),
                 Texture::Border::kClamp),
         static_cast<float>(-0.5 * kFarGround_m), static_cast<float>(-0.5 * kFarGround_m),
         static_cast<float>(1.0 / kFarTexel_m)});
    for (const double stretch : {1.0, 1.61803}) {
      scene_->ground.details.push_back(
          {Texture(drawGroundDetail(1024, options_.seed + 40), Texture::Border::kRepeat), 0.0F, 0.0F,
           static_cast<float>(1.0 / (kDetailTexel_m * stretch))});
    }
    addLevel(kLotArea, 0.0, near_ground);
    const double far = 0.5 * kFarGround_m;
    addLevel({-far, kLotArea.max_y, far, far}, 0.0, far_ground);
    addLevel({-far, -far, far, kLotArea.min_y}, 0.0, far_ground);
    addLevel({-far, kLotArea.min_y, kLotArea.min_x, kLotArea.max_y}, 0.0, far_ground);
    addLevel({kLotArea.max_x, kLotArea.min_y, far, kLotArea.max_y}, 0.0, far_ground);
    for (const GroundRectangle& island : layout_.islands) {
      addIsland(island, near_ground);
    }
  }

  void addLevel(const GroundRectangle& area, double z, uint32_t material) {
    const auto corner = [&](double x, double y) { return Eigen::Vector3d(x, y, z).cast<float>().eval(); };
    addQuad(corner(area.min_x, area.min_y), corner(area.max_x, area.min_y), corner(area.max_x, area.max_y),
            corner(area.min_x, area.max_y), material, &scene_->mesh);
  }

  // A raised area with a kerb of stones around it.
  void addIsland(const GroundRectangle& area, uint32_t ground) {
    addLevel(area, kKerbHeight_m, ground);
    constexpr double kStone_m = 1.0;
    constexpr double kKerbWidth_m = 0.14;
    const std::vector<Eigen::Vector2d> outline = corners(area);
    for (size_t i = 0; i < outline.size(); ++i) {
      const Eigen::Vector2d& from = outline[i];
      const Eigen::Vector2d edge = outline[(i + 1) % outline.size()] - from;
      const double yaw = std::atan2(edge.y(), edge.x());
      const int stones = std::max(1, static_cast<int>(edge.norm() / kStone_m));
      const double length = edge.norm() / stones;
      for (int k = 0; k < stones; ++k) {
        const Eigen::Vector2d middle = from + edge * ((k + 0.5) / stones);
        const Eigen::Isometry3f pose =
            placement(middle.x(), middle.y(), 0.5 * kKerbHeight_m + random_.uniform(-0.004, 0.004), yaw) *
            placement(0.0, 0.5 * kKerbWidth_m, 0.0, 0.0);
        const size_t first = scene_->mesh.vertices.size();
        addBox(pose, Eigen::Vector3d(length - 0.01, kKerbWidth_m, kKerbHeight_m + 0.012).cast<float>(),
               concrete_, &scene_->mesh);
        // Each stone shows another part of the texture.
        const auto shift = static_cast<float>(random_.uniform(0.0, 0.8));
        for (size_t v = first; v < scene_->mesh.vertices.size(); ++v) {
          scene_->mesh.vertices[v].u = shift + 0.2F * scene_->mesh.vertices[v].u;
        }
      }
    }
    scene_->obstacles.push_back({"kerb", corners(area), 0.0, kKerbHeight_m});
  }

  const CarMaterials& carMaterials(int shape_index, int paint_index) {
    const auto key = std::make_pair(shape_index, paint_index);
    const auto found = car_materials_.find(key);
    if (found != car_materials_.end()) {
      return found->second;
    }
    const CarShape& shape = carShapes()[static_cast<size_t>(shape_index)];
    const double paint = kPaints[static_cast<size_t>(paint_index)];
    CarMaterials car{};
    car.paint = plain(SurfaceKind::kCar, paint, 0.05);
    car.side = textured(SurfaceKind::kCar, drawCarSide(shape, paint), kCarTexelsPerM, 0.05);
    car.front = textured(SurfaceKind::kCar, drawCarFront(shape, paint), kCarTexelsPerM, 0.04);
    car.rear = textured(SurfaceKind::kCar, drawCarRear(shape, paint), kCarTexelsPerM, 0.04);
    car.glass = plain(SurfaceKind::kCar, 0.02, 0.06);
    car.trim = plain(SurfaceKind::kCar, 0.03);
    car.tyre = plain(SurfaceKind::kCar, 0.035);
    car.wheel =
        textured(SurfaceKind::kCar, drawWheel(static_cast<uint32_t>(shape_index * 5 + paint_index)), 150.0);
    car.plate = 0;
    return car_materials_.emplace(key, car).first->second;
  }

  void addCars() {
    const uint32_t plate_marker = plain(SurfaceKind::kCar, 0.6);
    std::map<std::pair<int, int>, TriangleMesh> meshes;
    for (const LotLayout::Car& car : layout_.cars) {
      const CarShape& shape = carShapes()[static_cast<size_t>(car.shape)];
      const auto key = std::make_pair(car.shape, car.paint);
      if (meshes.count(key) == 0) {
        CarMaterials materials = carMaterials(car.shape, car.paint);
        materials.plate = plate_marker;
        TriangleMesh mesh = makeCarMesh(shape, materials, true);
        bakeVertexAmbient(24, &mesh);
        meshes.emplace(key, std::move(mesh));
      }
      const size_t first = scene_->mesh.triangles.size();
      scene_->mesh.append(meshes.at(key), placement(car.x, car.y, 0.0, car.yaw_rad));
      Random plate_random(car.seed);
      std::string text = "BS ";
      for (int i = 0; i < 5; ++i) {
        text += i < 2 ? static_cast<char>('A' + plate_random.index(26))
                      : static_cast<char>('0' + plate_random.index(10));
      }
      const uint32_t plate = textured(SurfaceKind::kCar, drawPlate(text), 400.0);
      for (size_t i = first; i < scene_->mesh.triangles.size(); ++i) {
        uint32_t& material = scene_->mesh.triangles[i].material;
        material = material == plate_marker ? plate : material;
      }
      scene_->obstacles.push_back(
          {"car",
           orientedRectangle(car.x, car.y, car.yaw_rad, shape.rear(), shape.front(), 0.5 * shape.width), 0.0,
           shape.height});
    }
  }

  void addPlants() {
    std::vector<TriangleMesh> trees;
    for (int i = 0; i < kNumLotTrees + kNumTallTrees; ++i) {
      trees.push_back(makeTree(plants_, i < kNumLotTrees ? kLotLeaf_m : kTallTreeLeaf_m,
                               options_.foliage_density, options_.seed * 50U + static_cast<uint64_t>(i)));
    }
    for (const LotLayout::Tree& tree : layout_.trees) {
      Eigen::Isometry3f pose = placement(tree.x, tree.y, tree.z, tree.yaw_rad);
      TriangleMesh scaled = trees[static_cast<size_t>(tree.variant)];
      for (MeshVertex& vertex : scaled.vertices) {
        vertex.position *= static_cast<float>(tree.scale);
      }
      scene_->mesh.append(scaled, pose);
      scene_->obstacles.push_back(
          {"tree", circle(tree.x, tree.y, 0.2 * tree.scale), tree.z, tree.z + 2.0 * tree.scale});
    }
    for (const LotLayout::Bush& bush : layout_.bushes) {
      scene_->mesh.append(makeBush(plants_, bush.radius, bush.height, options_.foliage_density, bush.seed),
                          placement(bush.x, bush.y, bush.z, 0.0));
      scene_->obstacles.push_back(
          {"bush", circle(bush.x, bush.y, bush.radius), bush.z, bush.z + bush.height});
    }
    for (const LotLayout::Hedge& hedge : layout_.hedges) {
      const GroundRectangle& area = hedge.area;
      scene_->mesh.append(
          makeHedge(plants_, {area.width(), area.depth(), hedge.height}, options_.foliage_density,
                    random_.bits()),
          placement(0.5 * (area.min_x + area.max_x), 0.5 * (area.min_y + area.max_y), hedge.base_z, 0.0));
      scene_->obstacles.push_back({"hedge", corners(area), hedge.base_z, hedge.base_z + hedge.height});
    }
    for (const GroundRectangle& island : layout_.islands) {
      const double perimeter = 2.0 * (island.width() + island.depth());
      const int tufts = static_cast<int>(options_.foliage_density * perimeter * 0.9);
      for (int i = 0; i < tufts; ++i) {
        const bool along_x = random_.uniform() < island.width() / (island.width() + island.depth());
        const double inset = random_.uniform(0.12, 0.5);
        double x = random_.uniform(island.min_x + 0.2, island.max_x - 0.2);
        double y = random_.uniform(island.min_y + 0.2, island.max_y - 0.2);
        (along_x ? y : x) = random_.chance(0.5) ? (along_x ? island.min_y : island.min_x) + inset
                                                : (along_x ? island.max_y : island.max_x) - inset;
        addGrassTuft(Eigen::Vector3d(x, y, kKerbHeight_m).cast<float>(), random_.uniform(0.08, 0.25), 24,
                     plants_.leaves, random_.bits(), &scene_->mesh);
      }
    }
  }

  void addHouses() {
    const uint32_t roof = plain(SurfaceKind::kBuilding, 0.12);
    for (const LotLayout::Building& house : layout_.buildings) {
      const GroundRectangle& area = house.area;
      const std::vector<Eigen::Vector2d> outline = corners(area);
      const auto h = static_cast<float>(house.height);
      std::vector<Eigen::Vector3f> top;
      for (size_t i = 0; i < outline.size(); ++i) {
        const Eigen::Vector2d& a = outline[i];
        const Eigen::Vector2d& b = outline[(i + 1) % outline.size()];
        const uint32_t wall = textured(SurfaceKind::kBuilding,
                                       drawFacade((b - a).norm(), house.height, house.sign,
                                                  house.seed + 100U * static_cast<uint32_t>(i)),
                                       kFacadeTexelsPerM);
        const Eigen::Vector3f low_a(static_cast<float>(a.x()), static_cast<float>(a.y()), 0.0F);
        const Eigen::Vector3f low_b(static_cast<float>(b.x()), static_cast<float>(b.y()), 0.0F);
        const Eigen::Vector3f up(0.0F, 0.0F, h);
        addQuad(low_a, low_b, low_b + up, low_a + up, wall, &scene_->mesh);
        walls_.push_back({low_a, low_b - low_a, up, wall});
        top.push_back(low_a + up);
      }
      addQuad(top[0], top[1], top[2], top[3], roof, &scene_->mesh);
      scene_->obstacles.push_back({"building", outline, 0.0, house.height});
    }
  }

  void addFurniture() {
    for (const LotLayout::Pole& pole : layout_.poles) {
      const Eigen::Vector3f base = Eigen::Vector3d(pole.x, pole.y, pole.z).cast<float>();
      const Eigen::Vector3f top = base + Eigen::Vector3f(0.0F, 0.0F, static_cast<float>(pole.height));
      const auto radius = static_cast<float>(pole.radius);
      addFrustum(base, top, radius, 0.8F * radius, 10, true, pole.lamp ? metal_ : dark_metal_, &scene_->mesh);
      if (pole.lamp) {
        addBox(placement(pole.x, pole.y, pole.z + pole.height, 0.4), {0.5F, 0.22F, 0.12F}, metal_,
               &scene_->mesh);
      }
      scene_->obstacles.push_back(
          {"pole", circle(pole.x, pole.y, pole.radius), pole.z, pole.z + pole.height});
    }
    const uint32_t bin = textured(SurfaceKind::kOther, noiseImage(64, 64, 0.16, 0.3, 0.1, 0.3), 80.0);
    for (const LotLayout::Bin& place : layout_.bins) {
      const double z = layout_.groundHeight(place.x, place.y);
      addBox(placement(place.x, place.y, z + 0.5, place.yaw_rad), {0.55F, 0.6F, 1.0F}, bin, &scene_->mesh);
      addBox(placement(place.x, place.y, z + 1.03, place.yaw_rad), {0.6F, 0.66F, 0.07F}, dark_metal_,
             &scene_->mesh);
      scene_->obstacles.push_back(
          {"bin", orientedRectangle(place.x, place.y, place.yaw_rad, -0.3, 0.3, 0.33), z, z + 1.06});
    }
    for (const LotLayout::Fence& fence : layout_.fences) {
      addFence(fence);
    }
  }

  void addFence(const LotLayout::Fence& fence) {
    const Eigen::Vector3d from(fence.x0, fence.y0, fence.z);
    const Eigen::Vector3d to(fence.x1, fence.y1, fence.z);
    const double length = (to - from).norm();
    const Eigen::Vector3d along = (to - from) / length;
    const double yaw = std::atan2(along.y(), along.x());
    for (double s = 0.0; s <= length; s += 2.0) {
      const Eigen::Vector3d post = from + s * along;
      addFrustum(post.cast<float>(), (post + Eigen::Vector3d(0, 0, 1.3)).cast<float>(), 0.03F, 0.03F, 6, true,
                 metal_, &scene_->mesh);
    }
    for (const double height : {0.25, 0.6, 0.95, 1.25}) {
      const Eigen::Vector3d middle = 0.5 * (from + to) + Eigen::Vector3d(0, 0, height);
      addBox(placement(middle.x(), middle.y(), middle.z(), yaw), {static_cast<float>(length), 0.02F, 0.06F},
             metal_, &scene_->mesh);
    }
    scene_->obstacles.push_back(
        {"fence", orientedRectangle(fence.x0, fence.y0, yaw, 0.0, length, 0.03), fence.z, fence.z + 1.28});
  }

  // Woods and roofs far away: a ring with a ragged upper edge.
  void addSkyline() {
    const uint32_t woods = textured(SurfaceKind::kOther, noiseImage(2048, 64, 0.10, 0.55, 0.09, 0.12), 2.6);
    const auto seed = static_cast<uint32_t>(random_.bits());
    constexpr int kSegments = 900;
    const auto first = static_cast<uint32_t>(scene_->mesh.vertices.size());
    for (int i = 0; i <= kSegments; ++i) {
      const double angle = 2.0 * kPi * i / kSegments;
      const auto c = static_cast<float>(std::cos(angle));
      const auto s = static_cast<float>(std::sin(angle));
      const float height = 8.5F + 4.0F * fractalNoise(14.0F * c, 14.0F * s, 5, 0.7F, seed);
      MeshVertex vertex;
      vertex.normal = Eigen::Vector3f(-c, -s, 0.35F).normalized();
      vertex.u = static_cast<float>(i) / kSegments;
      vertex.v = 1.0F;
      vertex.ambient = 0.6F;
      vertex.position = Eigen::Vector3f(125.0F * c, 125.0F * s, -0.1F);
      scene_->mesh.vertices.push_back(vertex);
      vertex.v = 0.0F;
      vertex.position.z() = std::max(2.5F, height);
      scene_->mesh.vertices.push_back(vertex);
    }
    for (uint32_t i = 0; i < kSegments; ++i) {
      const uint32_t a = first + 2 * i;
      scene_->mesh.triangles.push_back({{a, a + 1, a + 3}, woods});
      scene_->mesh.triangles.push_back({{a, a + 3, a + 2}, woods});
    }
  }

  const LotOptions options_;
  const LotLayout layout_;
  Random random_;
  std::shared_ptr<Scene> scene_;
  PlantMaterials plants_{};
  std::vector<Wall> walls_;
  uint32_t concrete_ = 0, metal_ = 0, dark_metal_ = 0;
  std::map<std::pair<int, int>, CarMaterials> car_materials_;
};

}  // namespace

void LotOptions::validate() const {
  requireField(moved_cars >= 0.0 && moved_cars <= 1.0, "moved_cars", "must be in [0, 1]", moved_cars);
  requireField(ground_texel_m >= 0.005 && ground_texel_m <= 0.5, "ground_texel_m", "must be in [0.005, 0.5]",
               ground_texel_m);
  requireField(light_texel_m >= 0.02 && light_texel_m <= 0.5, "light_texel_m", "must be in [0.02, 0.5]",
               light_texel_m);
  requireField(foliage_density >= 0.0 && foliage_density <= 5.0, "foliage_density", "must be in [0, 5]",
               foliage_density);
}

std::shared_ptr<const Scene> buildLotScene(const LotOptions& options) {
  options.validate();
  return LotBuilder(options).build();
}

}  // namespace vcharge
