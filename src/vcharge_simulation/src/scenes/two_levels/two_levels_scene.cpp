#include <algorithm>
#include <cmath>

#include "scenes/garage/garage_surfaces.h"
#include "scenes/lot/lot_ground.h"
#include "scenes/lot/lot_variant.h"
#include "scenes/scene_builders.h"
#include "scenes/scene_parts.h"

namespace vcharge {

namespace {

constexpr double kSlope = 0.10510423526567646;  // tan(6 degrees)
constexpr double kRampFoot_m = -12.0;           // y of the lower end of the ramps
constexpr double kRampHead_m = 12.0;
constexpr double kRounding_m = 3.0;  // at both ends of the ramp, along y
constexpr double kInner_m = 22.9;    // largest |x| of the two levels; the ramps are outside
constexpr double kCell_m = 0.5;
constexpr double kRadPerM = 6.28318530717958647692;

// Bumps with amplitudes of a few centimetres and wavelengths of some metres.
double bumps(double x, double y) {
  const auto wave = [](double along, double length_m, double phase) {
    return std::sin(kRadPerM * along / length_m + phase);
  };
  return 0.010 * wave(x + 0.3 * y, 8.3, 0.4) + 0.009 * wave(y - 0.2 * x, 6.1, 1.9) +
         0.005 * wave(x - y, 4.7, 0.7);
}

// The slope changes linearly at both ends, so the height profile consists of parabolas and a line.
double rampHeight(double y) {
  const auto rise = [](double along_m) {
    const double in_rounding_m = std::clamp(along_m, 0.0, kRounding_m);
    return kSlope *
           (0.5 * in_rounding_m * in_rounding_m / kRounding_m + std::max(0.0, along_m - kRounding_m));
  };
  return rise(y - kRampFoot_m) - rise(y - kRampHead_m + kRounding_m);
}

double upperLevel() {
  return rampHeight(kRampHead_m);
}

double innerHeight(double x, double y) {
  return (y > 0.0 ? upperLevel() : 0.0) + bumps(x, y);
}
double outerHeight(double x, double y) {
  return rampHeight(y) + bumps(x, y);
}
double groundHeight(double x, double y) {
  return twoLevelsGroundHeight(x, y);
}

Eigen::Vector3f vertexAt(double x, double y, double z) {
  return Eigen::Vector3d(x, y, z).cast<float>();
}

void addTerrain(const GroundRectangle& area, const GroundHeight& height, uint32_t material,
                TriangleMesh* mesh) {
  const int columns = static_cast<int>(std::ceil(area.width() / kCell_m));
  const int rows = static_cast<int>(std::ceil(area.depth() / kCell_m));
  const auto first = static_cast<uint32_t>(mesh->vertices.size());
  for (int row = 0; row <= rows; ++row) {
    for (int column = 0; column <= columns; ++column) {
      const double x = area.min_x + area.width() * column / columns;
      const double y = area.min_y + area.depth() * row / rows;
      MeshVertex vertex;
      vertex.position = vertexAt(x, y, height(x, y));
      vertex.normal = Eigen::Vector3f::UnitZ();
      mesh->vertices.push_back(vertex);
    }
  }
  const auto index = [&](int column, int row) {
    return first + static_cast<uint32_t>(row * (columns + 1) + column);
  };
  for (int row = 0; row < rows; ++row) {
    for (int column = 0; column < columns; ++column) {
      const uint32_t a = index(column, row);
      const uint32_t b = index(column + 1, row);
      const uint32_t c = index(column + 1, row + 1);
      const uint32_t d = index(column, row + 1);
      mesh->triangles.push_back({{a, b, c}, material});
      mesh->triangles.push_back({{a, c, d}, material});
    }
  }
}

// Adds a wall along the line from `from` to `to`, visible from its right, between two heights that may vary
// along the line.
void addWall(const Eigen::Vector2d& from, const Eigen::Vector2d& to, const GroundHeight& low,
             const GroundHeight& high, double thickness_m, SceneParts* parts) {
  const Eigen::Vector2d edge = to - from;
  const double length_m = edge.norm();
  const double height_m = upperLevel() + 0.3;
  const uint32_t concrete =
      parts->textured(SurfaceKind::kBuilding,
                      drawFormedConcrete(static_cast<int>(length_m * kGarageTexelsPerM),
                                         static_cast<int>(height_m * kGarageTexelsPerM), 0.4,
                                         static_cast<uint32_t>(parts->random().bits())),
                      kGarageTexelsPerM);
  const int cells = static_cast<int>(std::ceil(length_m / kCell_m));
  for (int i = 0; i < cells; ++i) {
    const Eigen::Vector2d a = from + edge * i / cells;
    const Eigen::Vector2d b = from + edge * (i + 1) / cells;
    const double bottom = std::min(low(a.x(), a.y()), low(b.x(), b.y())) - 0.05;
    const TextureWindow window{static_cast<float>(i) / static_cast<float>(cells), 0.0F,
                               static_cast<float>(i + 1) / static_cast<float>(cells), 1.0F};
    addQuad(vertexAt(a.x(), a.y(), bottom), vertexAt(b.x(), b.y(), bottom),
            vertexAt(b.x(), b.y(), high(b.x(), b.y())), vertexAt(a.x(), a.y(), high(a.x(), a.y())), concrete,
            &parts->scene().mesh, window);
    if (thickness_m > 0.0 && high(a.x(), a.y()) > low(a.x(), a.y()) + 0.02) {
      const double yaw_rad = std::atan2(edge.y(), edge.x());
      parts->scene().obstacles.push_back(
          {"wall", orientedRectangle(a.x(), a.y(), yaw_rad, 0.0, (b - a).norm(), 0.5 * thickness_m), bottom,
           high(a.x(), a.y())});
    }
  }
}

void addGround(uint32_t material, SceneParts* parts) {
  TriangleMesh* mesh = &parts->scene().mesh;
  const GroundRectangle& lot = kLotArea;
  addTerrain(
      {-kInner_m, lot.min_y, kInner_m, 0.0}, [](double x, double y) { return bumps(x, y); }, material, mesh);
  addTerrain(
      {-kInner_m, 0.0, kInner_m, lot.max_y}, [](double x, double y) { return upperLevel() + bumps(x, y); },
      material, mesh);
  addTerrain({lot.min_x, lot.min_y, -kInner_m, lot.max_y}, outerHeight, material, mesh);
  addTerrain({kInner_m, lot.min_y, lot.max_x, lot.max_y}, outerHeight, material, mesh);
}

void addWalls(SceneParts* parts) {
  constexpr double kThickness_m = 0.2;
  const GroundHeight lower = [](double x, double y) { return bumps(x, y); };
  const GroundHeight upper = [](double x, double y) { return upperLevel() + bumps(x, y); };
  addWall({-kInner_m, 0.0}, {kInner_m, 0.0}, lower, upper, kThickness_m, parts);
  for (const double side : {-1.0, 1.0}) {
    const double x = side * kInner_m;
    // One wall visible from the lower level beside the ramp, one visible from the ramp below the upper level.
    addWall({x, side > 0.0 ? 0.0 : kRampFoot_m}, {x, side > 0.0 ? kRampFoot_m : 0.0}, lower, outerHeight,
            kThickness_m, parts);
    addWall({x, side > 0.0 ? 0.0 : kRampHead_m}, {x, side > 0.0 ? kRampHead_m : 0.0}, outerHeight, upper,
            kThickness_m, parts);
    for (double y = kRampFoot_m + 4.0; y < 0.0; y += 2.0) {
      parts->addFence({x, y, x, std::min(0.0, y + 2.0), rampHeight(y) + 0.1});
    }
    parts->addFence({x, 0.1, x, kRampHead_m - 3.0, upperLevel()});
  }
  parts->addFence({-kInner_m, 0.1, kInner_m, 0.1, upperLevel()});
  // Walls around the lot, down to the surrounding ground.
  const GroundRectangle& lot = kLotArea;
  const GroundHeight level = [](double, double) { return -0.1; };
  const std::vector<Eigen::Vector2d> corners = cornersOf(lot);
  for (size_t i = 0; i < corners.size(); ++i) {
    addWall(corners[i], corners[(i + 1) % corners.size()], level, groundHeight, 0.0, parts);
  }
}

template <class Thing>
void lift(std::vector<Thing>* things) {
  for (Thing& thing : *things) {
    thing.z += groundHeight(thing.x, thing.y);
  }
}

// Places the car on the ground with its four wheels.
void standOnGround(ParkedCar* car) {
  const CarShape& shape = carShapes()[static_cast<size_t>(car->shape)];
  const double c = std::cos(car->yaw_rad);
  const double s = std::sin(car->yaw_rad);
  const double half_track_m = 0.45 * shape.width;
  const auto height = [&](double along_m, double across_m) {
    return groundHeight(car->x + c * along_m - s * across_m, car->y + s * along_m + c * across_m);
  };
  const double rear_left = height(0.0, half_track_m);
  const double rear_right = height(0.0, -half_track_m);
  const double front_left = height(shape.wheelbase, half_track_m);
  const double front_right = height(shape.wheelbase, -half_track_m);
  car->z = 0.5 * (rear_left + rear_right);
  car->pitch_rad = -std::atan(0.5 * (front_left + front_right - rear_left - rear_right) / shape.wheelbase);
  car->roll_rad = std::atan(0.25 * (front_left + rear_left - front_right - rear_right) / half_track_m);
}

LotLayout twoLevelsLayout(const SceneOptions& options) {
  LotLayout layout = makeLotLayout(options.seed, options.day);
  // Islands, hedges and fences are level, so they cannot stand on the ramps or across the walls.
  const auto is_outside = [](const GroundRectangle& area) {
    return area.max_x < -kInner_m || area.min_x > kInner_m;
  };
  layout.islands.erase(std::remove_if(layout.islands.begin(), layout.islands.end(), is_outside),
                       layout.islands.end());
  for (GroundRectangle& island : layout.islands) {
    island.min_x = std::max(island.min_x, -kInner_m);
    island.max_x = std::min(island.max_x, kInner_m);
  }
  layout.hedges.erase(std::remove_if(layout.hedges.begin(), layout.hedges.end(),
                                     [&](const Hedge& hedge) { return is_outside(hedge.area); }),
                      layout.hedges.end());
  for (Hedge& hedge : layout.hedges) {
    hedge.base_z += groundHeight(hedge.area.min_x, hedge.area.min_y);
  }
  for (Fence& fence : layout.fences) {
    fence.z += groundHeight(0.0, fence.y0);
  }
  // Objects of the lot may stand on raised islands; here their height is set again from the clipped islands
  // and the uneven ground.
  const auto settle = [&](auto* things) {
    for (auto& thing : *things) {
      thing.z = layout.groundHeight(thing.x, thing.y);
    }
    lift(things);
  };
  layout.trees.erase(std::remove_if(layout.trees.begin(), layout.trees.end(),
                                    [](const Tree& tree) { return !kLotArea.contains(tree.x, tree.y); }),
                     layout.trees.end());
  settle(&layout.trees);
  settle(&layout.bushes);
  settle(&layout.poles);
  settle(&layout.bins);
  for (ParkedCar& car : layout.cars) {
    standOnGround(&car);
  }
  return layout;
}

}  // namespace

double twoLevelsGroundHeight(double x_m, double y_m) {
  return std::abs(x_m) < kInner_m ? innerHeight(x_m, y_m) : outerHeight(x_m, y_m);
}

std::shared_ptr<const Scene> buildTwoLevelsScene(const SceneOptions& options) {
  LotVariant two_levels;
  two_levels.layout = twoLevelsLayout(options);
  two_levels.add_ground = addGround;
  two_levels.add_things = addWalls;
  two_levels.ground_height = groundHeight;
  return buildLotVariant(options, two_levels);
}

}  // namespace vcharge
