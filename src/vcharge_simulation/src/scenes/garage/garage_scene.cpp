#include <algorithm>
#include <cmath>

#include <opencv2/imgproc.hpp>

#include "scenes/garage/garage_fittings.h"
#include "scenes/garage/garage_surfaces.h"
#include "scenes/lot/lot_ground.h"
#include "scenes/movers/scene_movers.h"
#include "scenes/scene_builders.h"
#include "scenes/scene_parts.h"

namespace vcharge {

namespace {

constexpr double kFloorTexel_m = 0.0125;
constexpr float kLampRadiance = 2.4F;
constexpr double kCeilingTexel_m = 0.1;
constexpr double kCeilingAlbedo = 0.6;
// Irradiance at baked light 1; the camera's exposure is set for the garage.
constexpr double kFullIrradiance = 4.5;
constexpr double kFullIlluminance_lx = 1500.0;  // the same in reality
constexpr double kTypicalCeilingLight = 0.12;
constexpr float kFloorReflectivity = 0.03F;
// Panels are split into cells of this size, because lamp light is baked at their corners.
constexpr double kLightCell_m = 0.5;

LightOptions lampLight() {
  LightOptions light;
  light.sun_irradiance = 0.0;
  light.sky_irradiance = kFullIrradiance;
  light.bounce_irradiance = kFullIrradiance;
  return light;
}

Eigen::Vector3f vector(double x, double y, double z) {
  return Eigen::Vector3d(x, y, z).cast<float>();
}

// After hours every other lamp is off.
GarageLayout litLayout(const Conditions& conditions, const SceneOptions& options) {
  GarageLayout layout = makeGarageLayout(options.seed, options.day, options.layout_seed);
  for (size_t i = 0; i < layout.lamps.size() && conditions.is_dark; i += 2) {
    layout.lamps[i].intensity = 0.0F;
  }
  return layout;
}

// Builds one garage; each step adds to the scene.
class GarageBuilder {
 public:
  explicit GarageBuilder(const SceneOptions& options)
      : options_(options),
        seed_(options.seed),
        conditions_(conditionsOf(options.condition)),
        layout_(litLayout(conditions_, options)),
        plan_(layout_.plan),
        parts_(seed_ * 53U + 7U, 1.0, SurfaceVariety::indoors(options.surface_seed)) {}

  std::shared_ptr<const Scene> build() {
    scene().sky = std::make_unique<Sky>(lampLight(), 1);
    scene().min_m = {plan_.area.min_x, plan_.area.min_y};
    scene().max_m = {plan_.area.max_x, plan_.area.max_y};
    scene().overhead_m = plan_.overhead();
    addFloor();
    addWalls();
    addCeiling();
    addPillars();
    addPipes();
    addLamps();
    addGarageFittings(layout_, &parts_);
    parts_.addCars(layout_.cars);
    LampOptions light;
    light.floor_texel_m = 0.1 / options_.detail;
    light.gathered_rays = static_cast<int>(std::lround(24 * options_.detail));
    bakeLampLight(layout_.lamps, light, scene().min_m, scene().max_m, &scene());
    addCeilingReflection();
    scene().vehicle_lamps = vehicleLampsOf(conditions_, kFullIlluminance_lx / kFullIrradiance);
    scene().bays = paintedBays(layout_.bays, layout_.cars);
    addMovers(options_, {plan_.area, plan_.lanes, layout_.bays}, &parts_);
    return parts_.sharedScene();
  }

 private:
  Scene& scene() { return parts_.scene(); }

  void addFloor() {
    const double texel_m = std::min(0.5, kFloorTexel_m / options_.image_scale);
    Material floor;
    floor.kind = SurfaceKind::kGround;
    floor.mapping = Material::Mapping::kGround;
    floor.texture = 0;
    floor.reflectivity = kFloorReflectivity;
    floor.wetness = static_cast<float>(conditions_.wetness);
    const uint32_t material = scene().addMaterial(floor);
    cv::Mat painted_floor = drawGarageFloor(layout_, texel_m, seed_);
    parts_.surfaces().fade(1.0 / texel_m, &painted_floor);
    scene().ground.layers.push_back(
        {Texture(painted_floor, Texture::Border::kClamp), static_cast<float>(plan_.area.min_x),
         static_cast<float>(plan_.area.min_y), static_cast<float>(1.0 / texel_m)});
    parts_.addGroundDetails(seed_);
    parts_.addLevel(plan_.area, 0.0, material);
  }

  // Adds a flat panel, split into cells to resolve the light baked at their corners.
  void addPanel(const Eigen::Vector3f& corner, const Eigen::Vector3f& along, const Eigen::Vector3f& up,
                uint32_t material, const TextureWindow& window = TextureWindow()) {
    const int columns = std::max(1, static_cast<int>(std::ceil(along.norm() / kLightCell_m)));
    const int rows = std::max(1, static_cast<int>(std::ceil(up.norm() / kLightCell_m)));
    for (int row = 0; row < rows; ++row) {
      for (int column = 0; column < columns; ++column) {
        const auto fraction = [](int i, int n) { return static_cast<float>(i) / static_cast<float>(n); };
        const float s0 = fraction(column, columns);
        const float s1 = fraction(column + 1, columns);
        const float t0 = fraction(row, rows);
        const float t1 = fraction(row + 1, rows);
        const float width = window.u1 - window.u0;
        const float height = window.v1 - window.v0;
        const TextureWindow part{window.u0 + s0 * width, window.v1 - t1 * height, window.u0 + s1 * width,
                                 window.v1 - t0 * height};
        addQuad(corner + s0 * along + t0 * up, corner + s1 * along + t0 * up, corner + s1 * along + t1 * up,
                corner + s0 * along + t1 * up, material, &scene().mesh, part);
      }
    }
  }

  void addWalls() {
    const std::vector<Eigen::Vector2d> outline = cornersOf(plan_.area);
    for (size_t i = 0; i < outline.size(); ++i) {
      // The outline is reversed so that the walls face inwards.
      const Eigen::Vector2d& from = outline[(i + 1) % outline.size()];
      const Eigen::Vector2d edge = outline[i] - from;
      const uint32_t wall = parts_.textured(
          SurfaceKind::kBuilding,
          drawGarageWall(edge.norm(), plan_.height_m, plan_.walls, static_cast<uint32_t>(seed_ * 9U + i)),
          kGarageTexelsPerM);
      addPanel(vector(from.x(), from.y(), 0.0), vector(edge.x(), edge.y(), 0.0),
               vector(0.0, 0.0, plan_.height_m), wall);
    }
  }

  void addCeiling() {
    constexpr double kTile_m = 16.0;
    const int size = 1024;
    const auto mean = static_cast<float>(kCeilingAlbedo);
    const uint32_t concrete = parts_.textured(
        SurfaceKind::kOther, drawFormedConcrete(size, size, mean, static_cast<uint32_t>(seed_ + 70U)),
        kGarageTexelsPerM, 0.0, Texture::Border::kRepeat);
    const GroundRectangle& area = plan_.area;
    const auto repeats_x = static_cast<float>(area.width() / kTile_m);
    const auto repeats_y = static_cast<float>(area.depth() / kTile_m);
    addPanel(vector(area.min_x, area.max_y, plan_.height_m), vector(area.width(), 0.0, 0.0),
             vector(0.0, -area.depth(), 0.0), concrete, {0.0F, 0.0F, repeats_x, repeats_y});
    const double height = plan_.height_m - plan_.beam_height_m;
    const auto beam = [&](double x, double y, double length, double width, bool along_x) {
      const double dx = 0.5 * (along_x ? length : width);
      const double dy = 0.5 * (along_x ? width : length);
      const auto repeats = static_cast<float>((along_x ? length : width) / kTile_m);
      const Eigen::Vector3f up = vector(0.0, 0.0, height);
      addPanel(vector(x - dx, y - dy, plan_.beam_height_m), vector(2.0 * dx, 0.0, 0.0), up, concrete,
               {0.0F, 0.0F, repeats, 0.02F});
      addPanel(vector(x + dx, y + dy, plan_.beam_height_m), vector(-2.0 * dx, 0.0, 0.0), up, concrete,
               {0.3F, 0.3F, 0.3F + repeats, 0.32F});
      const auto depth_repeats = static_cast<float>(2.0 * dy / kTile_m);
      addPanel(vector(x + dx, y - dy, plan_.beam_height_m), vector(0.0, 2.0 * dy, 0.0), up, concrete,
               {0.5F, 0.1F, 0.5F + depth_repeats, 0.12F});
      addPanel(vector(x - dx, y + dy, plan_.beam_height_m), vector(0.0, -2.0 * dy, 0.0), up, concrete,
               {0.7F, 0.6F, 0.7F + depth_repeats, 0.62F});
      addPanel(vector(x - dx, y + dy, plan_.beam_height_m), vector(2.0 * dx, 0.0, 0.0),
               vector(0.0, -2.0 * dy, 0.0), concrete, {0.2F, 0.2F, 0.2F + repeats, 0.2F + depth_repeats});
    };
    for (const double x : layout_.beam_x) {
      beam(x, 0.0, area.depth(), 0.36, false);
    }
    // Beams along the garage are slightly narrower, so that crossing beams do not repeat faces.
    for (const double y : layout_.beam_y) {
      beam(0.0, y, area.width(), 0.3, true);
    }
  }

  void addPillars() {
    uint32_t number = 0;
    for (const GarageLayout::Pillar& pillar : layout_.pillars) {
      const uint32_t material =
          parts_.textured(SurfaceKind::kPole,
                          drawGaragePillar(pillar.name, plan_.pillar_width_m, plan_.height_m,
                                           static_cast<uint32_t>(seed_ * 131U) + number++),
                          kGarageTexelsPerM);
      if (plan_.has_round_pillars) {
        addRoundPillar(pillar, material);
        continue;
      }
      const double half = 0.5 * plan_.pillar_width_m;
      const std::vector<Eigen::Vector2d> corners =
          orientedRectangle(pillar.x, pillar.y, 0.0, -half, half, half);
      for (size_t i = 0; i < corners.size(); ++i) {
        const Eigen::Vector2d edge = corners[(i + 1) % corners.size()] - corners[i];
        const float u = 0.25F * static_cast<float>(i);
        addPanel(vector(corners[i].x(), corners[i].y(), 0.0), vector(edge.x(), edge.y(), 0.0),
                 vector(0.0, 0.0, plan_.height_m), material, {u, 0.0F, u + 0.25F, 1.0F});
      }
      // A lid at the overhead limit, so that the height map sees a solid pillar.
      parts_.addLevel({corners[0].x(), corners[0].y(), corners[2].x(), corners[2].y()},
                      plan_.overhead() - 0.01, material);
      scene().obstacles.push_back({"pillar", corners, 0.0, plan_.height_m});
    }
  }

  // Stacked pieces, each with its part of the texture.
  void addRoundPillar(const GarageLayout::Pillar& pillar, uint32_t material) {
    const auto radius = static_cast<float>(0.5 * plan_.pillar_width_m);
    const int pieces = static_cast<int>(std::ceil(plan_.height_m / kLightCell_m));
    std::vector<MeshVertex>& vertices = scene().mesh.vertices;
    for (int i = 0; i < pieces; ++i) {
      const double low = plan_.height_m * i / pieces;
      const double high = plan_.height_m * (i + 1) / pieces;
      const size_t first = vertices.size();
      addFrustum(vector(pillar.x, pillar.y, low), vector(pillar.x, pillar.y, high), radius, radius, 16, false,
                 material, &scene().mesh);
      for (size_t v = first; v < vertices.size(); ++v) {
        vertices[v].v = 1.0F - vertices[v].position.z() / static_cast<float>(plan_.height_m);
      }
    }
    const double lid = plan_.overhead() - 0.01;
    addFrustum(vector(pillar.x, pillar.y, lid - 0.01), vector(pillar.x, pillar.y, lid), radius, radius, 16,
               true, material, &scene().mesh);
    scene().obstacles.push_back({"pillar", circleAround(pillar.x, pillar.y, radius), 0.0, plan_.height_m});
  }

  // Sprinkler pipes and a duct under the beams, in pieces that each get their own baked light.
  void addPipes() {
    constexpr double kPiece_m = 2.0;
    const auto pipe = [&](double y, double z, double radius, uint32_t material) {
      for (double x = plan_.area.min_x; x < plan_.area.max_x - 1e-6; x += kPiece_m) {
        addFrustum(vector(x, y, z), vector(x + kPiece_m, y, z), static_cast<float>(radius),
                   static_cast<float>(radius), 8, false, material, &scene().mesh);
      }
    };
    const uint32_t red = parts_.plain(SurfaceKind::kOther, 0.12, 0.03);
    const uint32_t zinc = parts_.plain(SurfaceKind::kOther, 0.45, 0.05);
    for (const double side : {-1.0, 1.0}) {
      pipe(plan_.shifted(side * 12.0), 2.33 + plan_.lift(), 0.05, red);
      pipe(plan_.shifted(side * 18.2), 2.33 + plan_.lift(), 0.04, red);
      pipe(plan_.shifted(side * 3.4), 2.3 + plan_.lift(), 0.09, zinc);
    }
    for (double x = plan_.area.min_x; x < plan_.area.max_x - 1e-6; x += kPiece_m) {
      addBox(placement(x + 0.5 * kPiece_m, plan_.area.max_y - 0.6, 2.35 + plan_.lift(), 0.0),
             vector(kPiece_m - 0.02, 0.6, 0.35), zinc, &scene().mesh);
      const double near_y = plan_.area.max_y - 0.9;
      const double far_y = plan_.area.max_y - 0.3;
      const double low = 2.175 + plan_.lift();
      addQuad(vector(x, far_y, low), vector(x + kPiece_m, far_y, low), vector(x + kPiece_m, near_y, low),
              vector(x, near_y, low), zinc, &scene().mesh);
    }
  }

  void addLamps() {
    const uint32_t housing = parts_.plain(SurfaceKind::kOther, 0.6);
    for (const Lamp& lamp : layout_.lamps) {
      Material tube;
      tube.kind = SurfaceKind::kOther;
      tube.albedo = 0.5F;
      tube.emission = kLampRadiance * lamp.intensity / 3.0F;
      const uint32_t light = scene().addMaterial(tube);
      const bool along_x = std::abs(lamp.half_length.x()) > 0.1F;
      const float length = 2.0F * lamp.half_length.norm();
      const Eigen::Vector3f size(along_x ? length : 0.1F, along_x ? 0.1F : length, 0.07F);
      addBox(placement(lamp.centre.x(), lamp.centre.y(), lamp.centre.z(), 0.0), size, light, &scene().mesh);
      const Eigen::Vector3f half = 0.5F * size;
      const float low = lamp.centre.z() - half.z();
      addQuad({lamp.centre.x() - half.x(), lamp.centre.y() + half.y(), low},
              {lamp.centre.x() + half.x(), lamp.centre.y() + half.y(), low},
              {lamp.centre.x() + half.x(), lamp.centre.y() - half.y(), low},
              {lamp.centre.x() - half.x(), lamp.centre.y() - half.y(), low}, light, &scene().mesh);
      addBox(placement(lamp.centre.x(), lamp.centre.y(), lamp.centre.z() + 0.06, 0.0),
             size + Eigen::Vector3f(0.06F, 0.06F, -0.02F), housing, &scene().mesh);
      // Rod to the ceiling.
      addFrustum(lamp.centre, {lamp.centre.x(), lamp.centre.y(), static_cast<float>(plan_.height_m)}, 0.015F,
                 0.015F, 5, false, housing, &scene().mesh);
    }
  }

  void addCeilingReflection() {
    const GroundRectangle& area = plan_.area;
    cv::Mat image(
        static_cast<int>(area.depth() / kCeilingTexel_m), static_cast<int>(area.width() / kCeilingTexel_m),
        CV_8UC1, cv::Scalar(255.0 * kCeilingAlbedo * kTypicalCeilingLight * kFullIrradiance / kLampRadiance));
    for (const Lamp& lamp : layout_.lamps) {
      const auto texel = [&](float metres, double origin_m) {
        return static_cast<int>(std::lround((metres - origin_m) / kCeilingTexel_m * 8.0));
      };
      const Eigen::Vector3f from = lamp.centre - lamp.half_length;
      const Eigen::Vector3f to = lamp.centre + lamp.half_length;
      cv::line(image, {texel(from.x(), area.min_x), texel(from.y(), area.min_y)},
               {texel(to.x(), area.min_x), texel(to.y(), area.min_y)},
               cv::Scalar(255.0 * lamp.intensity / 3.0), 1, cv::LINE_8, 3);
    }
    scene().ceiling = std::make_unique<Ceiling>(
        Ceiling{static_cast<float>(plan_.height_m),
                kLampRadiance,
                {Texture(image, Texture::Border::kClamp), static_cast<float>(area.min_x),
                 static_cast<float>(area.min_y), static_cast<float>(1.0 / kCeilingTexel_m)}});
  }

  const SceneOptions options_;
  const uint64_t seed_;
  const Conditions conditions_;
  const GarageLayout layout_;
  const GaragePlan& plan_;
  SceneParts parts_;
};

}  // namespace

std::shared_ptr<const Scene> buildGarageScene(const SceneOptions& options) {
  return GarageBuilder(options).build();
}

}  // namespace vcharge
