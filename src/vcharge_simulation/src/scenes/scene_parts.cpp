#include "scenes/scene_parts.h"

#include <array>
#include <cmath>
#include <string>

#include "scenes/lot/facade.h"
#include "scenes/lot/lot_ground.h"

namespace vcharge {

namespace {

constexpr double kDetailTexel_m = 0.0035;
constexpr float kPoleLampReach_m = 60.0F;
constexpr double kPi = 3.14159265358979323846;
constexpr double kSmallTreeLeaf_m = 0.12;
constexpr double kTallTreeLeaf_m = 0.17;  // multiplied by the scale of the tree
constexpr std::array<double, kNumPaints> kPaints = {0.025, 0.07, 0.18, 0.4, 0.72};

}  // namespace

SceneParts::SceneParts(uint64_t random_seed, double foliage_density, const SurfaceVariety& surfaces)
    : foliage_density_(foliage_density * surfaces.foliage),
      surfaces_(surfaces),
      random_(random_seed),
      scene_(std::make_shared<Scene>()) {
  addMaterials();
}

uint32_t SceneParts::plain(SurfaceKind kind, double albedo, double reflectivity) {
  Material material;
  material.kind = kind;
  material.albedo = static_cast<float>(albedo);
  material.reflectivity = static_cast<float>(reflectivity);
  return scene_->addMaterial(material);
}

uint32_t SceneParts::textured(SurfaceKind kind, const cv::Mat& image, double texels_per_m,
                              double reflectivity, Texture::Border border) {
  Material material;
  material.kind = kind;
  material.albedo = 1.0F;
  material.texels_per_m = static_cast<float>(texels_per_m);
  material.reflectivity = static_cast<float>(reflectivity);
  cv::Mat faded = image;
  if (kind == SurfaceKind::kBuilding || kind == SurfaceKind::kPole) {
    surfaces_.fade(texels_per_m, &faded);
  }
  return scene_->addTexturedMaterial(faded, border, material);
}

cv::Mat SceneParts::noiseImage(int width, int height, double mean, double contrast, double scale_x,
                               double scale_y) {
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

void SceneParts::addMaterials() {
  plants_.bark = textured(SurfaceKind::kPlant, noiseImage(128, 256, 0.14, 0.5, 0.25, 0.06), 150.0);
  Material leaves;
  leaves.kind = SurfaceKind::kPlant;
  leaves.two_sided = true;
  leaves.translucency = 0.35F;
  // Each leaf has one tone (u is random), so the level of detail must not average the texture.
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

void SceneParts::addGroundDetails(uint64_t seed) {
  GroundLayers& ground = scene_->ground;
  ground.detail_contrast *= static_cast<float>(surfaces_.grain);
  ground.relief_m = static_cast<float>(surfaces_.relief_m);
  std::vector<double> stretches = {1.0, 1.61803};
  if (surfaces_.has_coarse_grain) {
    stretches.push_back(4.2);
  }
  const Texture detail(drawGroundDetail(1024, seed + 40), Texture::Border::kRepeat);
  for (const double stretch : stretches) {
    ground.details.push_back(
        {detail, 0.0F, 0.0F, static_cast<float>(1.0 / (kDetailTexel_m * surfaces_.grain_size * stretch))});
  }
}

void SceneParts::addLevel(const GroundRectangle& area, double z, uint32_t material) {
  const auto corner = [&](double x, double y) { return Eigen::Vector3d(x, y, z).cast<float>().eval(); };
  addQuad(corner(area.min_x, area.min_y), corner(area.max_x, area.min_y), corner(area.max_x, area.max_y),
          corner(area.min_x, area.max_y), material, &scene_->mesh);
}

void SceneParts::addIsland(const GroundRectangle& area, uint32_t ground, double base_z_m, const Kerb& kerb) {
  addLevel(area, base_z_m + kerb.height_m, ground);
  constexpr double kStone_m = 1.0;
  constexpr double kKerbWidth_m = 0.14;
  constexpr float kBevel_m = 0.08F;
  const std::vector<Eigen::Vector2d> outline = cornersOf(area);
  for (size_t i = 0; i < outline.size(); ++i) {
    const Eigen::Vector2d& from = outline[i];
    const Eigen::Vector2d edge = outline[(i + 1) % outline.size()] - from;
    const double yaw = std::atan2(edge.y(), edge.x());
    const int stones = std::max(1, static_cast<int>(edge.norm() / kStone_m));
    const double length = edge.norm() / stones;
    for (int k = 0; k < stones; ++k) {
      const Eigen::Vector2d middle = from + edge * ((k + 0.5) / stones);
      const Eigen::Isometry3f pose =
          placement(middle.x(), middle.y(), base_z_m + (0.5 * kerb.height_m + random_.uniform(-0.004, 0.004)),
                    yaw) *
          placement(0.0, 0.5 * kKerbWidth_m, 0.0, 0.0);
      const size_t first = scene_->mesh.vertices.size();
      addBox(pose, Eigen::Vector3d(length - 0.01, kKerbWidth_m, kerb.height_m + 0.012).cast<float>(),
             concrete_, &scene_->mesh);
      // Each stone shows a different part of the texture.
      const auto shift = static_cast<float>(random_.uniform(0.0, 0.8));
      for (size_t v = first; v < scene_->mesh.vertices.size(); ++v) {
        MeshVertex& vertex = scene_->mesh.vertices[v];
        vertex.u = shift + 0.2F * vertex.u;
        const Eigen::Vector3f in_stone = pose.inverse() * vertex.position;
        if (kerb.is_bevelled && in_stone.y() < 0.0F && in_stone.z() > 0.0F) {
          vertex.position = pose * (in_stone + Eigen::Vector3f(0.0F, kBevel_m, 0.0F));
        }
      }
    }
  }
  scene_->obstacles.push_back(obstacleOf(area, kerb, base_z_m));
}

const CarMaterials& SceneParts::carMaterials(int shape_index, int paint_index) {
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

TriangleMesh SceneParts::carMesh(int shape, int paint, uint32_t seed) {
  if (!plate_marker_) {
    plate_marker_ = plain(SurfaceKind::kCar, 0.6);
  }
  const auto key = std::make_pair(shape, paint);
  if (car_meshes_.count(key) == 0) {
    CarMaterials materials = carMaterials(shape, paint);
    materials.plate = *plate_marker_;
    TriangleMesh mesh = makeCarMesh(carShapes()[static_cast<size_t>(shape)], materials, true);
    bakeVertexAmbient(24, &mesh);
    car_meshes_.emplace(key, std::move(mesh));
  }
  Random plate_random(seed);
  std::string text = "BS ";
  for (int i = 0; i < 5; ++i) {
    text += i < 2 ? static_cast<char>('A' + plate_random.index(26))
                  : static_cast<char>('0' + plate_random.index(10));
  }
  const uint32_t plate = textured(SurfaceKind::kCar, drawPlate(text), 400.0);
  TriangleMesh mesh = car_meshes_.at(key);
  for (MeshTriangle& triangle : mesh.triangles) {
    triangle.material = triangle.material == *plate_marker_ ? plate : triangle.material;
  }
  return mesh;
}

void SceneParts::addCars(const std::vector<ParkedCar>& cars) {
  for (const ParkedCar& car : cars) {
    scene_->mesh.append(carMesh(car.shape, car.paint, car.seed),
                        placement(car.x, car.y, car.z, car.yaw_rad) *
                            Eigen::AngleAxisf(static_cast<float>(car.pitch_rad), Eigen::Vector3f::UnitY()) *
                            Eigen::AngleAxisf(static_cast<float>(car.roll_rad), Eigen::Vector3f::UnitX()));
    scene_->obstacles.push_back(obstacleOf(car));
  }
}

void SceneParts::addTrees(const std::vector<Tree>& trees, uint64_t seed) {
  std::vector<TriangleMesh> variants;
  for (int i = 0; i < kNumSmallTrees + kNumTallTrees; ++i) {
    variants.push_back(makeTree(plants_,
                                surfaces_.leaf * (i < kNumSmallTrees ? kSmallTreeLeaf_m : kTallTreeLeaf_m),
                                foliage_density_, seed * 50U + static_cast<uint64_t>(i)));
  }
  for (const Tree& tree : trees) {
    Eigen::Isometry3f pose = placement(tree.x, tree.y, tree.z, tree.yaw_rad);
    TriangleMesh scaled = variants[static_cast<size_t>(tree.variant)];
    for (MeshVertex& vertex : scaled.vertices) {
      vertex.position *= static_cast<float>(tree.scale);
    }
    scene_->mesh.append(scaled, pose);
    scene_->obstacles.push_back(obstacleOf(tree));
  }
}

void SceneParts::addBushes(const std::vector<Bush>& bushes) {
  for (const Bush& bush : bushes) {
    scene_->mesh.append(
        makeBush(plants_, bush.radius, bush.height, surfaces_.leaf, foliage_density_, bush.seed),
        placement(bush.x, bush.y, bush.z, 0.0));
    scene_->obstacles.push_back(obstacleOf(bush));
  }
}

void SceneParts::addHedges(const std::vector<Hedge>& hedges) {
  for (const Hedge& hedge : hedges) {
    const GroundRectangle& area = hedge.area;
    scene_->mesh.append(
        makeHedge(plants_, {area.width(), area.depth(), hedge.height}, surfaces_.leaf, foliage_density_,
                  random_.bits()),
        placement(0.5 * (area.min_x + area.max_x), 0.5 * (area.min_y + area.max_y), hedge.base_z, 0.0));
    scene_->obstacles.push_back(obstacleOf(hedge));
  }
}

void SceneParts::addGrassAlong(const GroundRectangle& area, double base_z_m, const Kerb& kerb) {
  const double perimeter = 2.0 * (area.width() + area.depth());
  const int tufts = static_cast<int>(foliage_density_ * perimeter * 0.9);
  for (int i = 0; i < tufts; ++i) {
    const bool along_x = random_.uniform() < area.width() / (area.width() + area.depth());
    const double inset = random_.uniform(0.12, 0.5);
    double x = random_.uniform(area.min_x + 0.2, area.max_x - 0.2);
    double y = random_.uniform(area.min_y + 0.2, area.max_y - 0.2);
    (along_x ? y : x) = random_.chance(0.5) ? (along_x ? area.min_y : area.min_x) + inset
                                            : (along_x ? area.max_y : area.max_x) - inset;
    addGrassTuft(Eigen::Vector3d(x, y, base_z_m + kerb.height_m).cast<float>(), random_.uniform(0.08, 0.25),
                 24, plants_.leaves, random_.bits(), &scene_->mesh);
  }
}

void SceneParts::addHouses(const std::vector<Building>& houses) {
  const uint32_t roof = plain(SurfaceKind::kBuilding, 0.12);
  for (const Building& house : houses) {
    const GroundRectangle& area = house.area;
    const std::vector<Eigen::Vector2d> outline = cornersOf(area);
    const auto h = static_cast<float>(house.height);
    std::vector<Eigen::Vector3f> top;
    for (size_t i = 0; i < outline.size(); ++i) {
      const Eigen::Vector2d& a = outline[i];
      const Eigen::Vector2d& b = outline[(i + 1) % outline.size()];
      const uint32_t wall = textured(
          SurfaceKind::kBuilding,
          drawFacade((b - a).norm(), house.height, house.sign, house.seed + 100U * static_cast<uint32_t>(i)),
          kFacadeTexelsPerM);
      const Eigen::Vector3f low_a(static_cast<float>(a.x()), static_cast<float>(a.y()), 0.0F);
      const Eigen::Vector3f low_b(static_cast<float>(b.x()), static_cast<float>(b.y()), 0.0F);
      const Eigen::Vector3f up(0.0F, 0.0F, h);
      addQuad(low_a, low_b, low_b + up, low_a + up, wall, &scene_->mesh);
      walls_.push_back({low_a, low_b - low_a, up, wall});
      top.push_back(low_a + up);
    }
    addQuad(top[0], top[1], top[2], top[3], roof, &scene_->mesh);
    scene_->obstacles.push_back(obstacleOf(house));
  }
}

void SceneParts::addPoles(const std::vector<Pole>& poles, double lamp_cd) {
  constexpr double kWhiteInSun_cd_per_m2 = kSunIlluminance_lx / 3.14159265358979323846;
  const Eigen::Vector3f head_m(0.5F, 0.22F, 0.12F);
  uint32_t head = metal_;
  if (lamp_cd > 0.0) {
    Material glowing = scene_->materials[metal_];
    glowing.emission = static_cast<float>(lamp_cd / kWhiteInSun_cd_per_m2) / (head_m.x() * head_m.y());
    head = scene_->addMaterial(glowing);
  }
  for (const Pole& pole : poles) {
    const Eigen::Vector3f base = Eigen::Vector3d(pole.x, pole.y, pole.z).cast<float>();
    const Eigen::Vector3f top = base + Eigen::Vector3f(0.0F, 0.0F, static_cast<float>(pole.height));
    const auto radius = static_cast<float>(pole.radius);
    addFrustum(base, top, radius, 0.8F * radius, 10, true, pole.lamp ? metal_ : dark_metal_, &scene_->mesh);
    if (pole.lamp) {
      addBox(placement(pole.x, pole.y, pole.z + pole.height, 0.4), head_m, head, &scene_->mesh);
      if (lamp_cd > 0.0) {
        Lamp lamp;
        lamp.centre = top - Eigen::Vector3f(0.0F, 0.0F, 0.5F * head_m.z());
        lamp.intensity = static_cast<float>(lamp_cd / kSunIlluminance_lx);
        lamp.reach_m = kPoleLampReach_m;
        scene_->lamps.push_back(lamp);
      }
    }
    scene_->obstacles.push_back(obstacleOf(pole));
  }
}

void SceneParts::addBins(const std::vector<Bin>& bins) {
  const uint32_t material = textured(SurfaceKind::kOther, noiseImage(64, 64, 0.16, 0.3, 0.1, 0.3), 80.0);
  for (const Bin& bin : bins) {
    const double z = bin.z;
    addBox(placement(bin.x, bin.y, z + 0.5, bin.yaw_rad), {0.55F, 0.6F, 1.0F}, material, &scene_->mesh);
    addBox(placement(bin.x, bin.y, z + 1.03, bin.yaw_rad), {0.6F, 0.66F, 0.07F}, dark_metal_, &scene_->mesh);
    scene_->obstacles.push_back(obstacleOf(bin));
  }
}

void SceneParts::addFence(const Fence& fence) {
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
  scene_->obstacles.push_back(obstacleOf(fence));
}

void SceneParts::addSkyline() {
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

}  // namespace vcharge
