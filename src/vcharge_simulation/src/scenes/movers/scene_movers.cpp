#include "scenes/movers/scene_movers.h"

#include <algorithm>
#include <cmath>
#include <map>
#include <memory>
#include <string>
#include <utility>

#include "objects/bicycle.h"
#include "objects/clothing.h"
#include "scenes/movers/mover_planner.h"
#include "scenes/scene_parts.h"

namespace vcharge {

namespace {

constexpr double kTwoPi = 6.28318530717958647692;
constexpr double kWalking_m_per_s = 0.8;  // arms and legs swing fully from this speed on
constexpr double kCrankTurn_m = 5.0;      // distance covered by a turn of the pedals
constexpr double kClothTexelsPerM = 120.0;

// Mesh in the mover's frame, for a distance walked or driven and a speed.
using MeshOf = std::function<TriangleMesh(double along_m, double speed_m_per_s)>;

FigureMaterials dress(uint32_t look, SceneParts* parts) {
  Random random(look);
  const auto cloth = [&](int pattern, double tone) {
    return parts->textured(SurfaceKind::kOther,
                           drawCloth(pattern, tone, static_cast<uint32_t>(random.bits())), kClothTexelsPerM);
  };
  FigureMaterials materials{};
  materials.skin = parts->plain(SurfaceKind::kOther, random.uniform(0.12, 0.4));
  materials.jacket = cloth(random.index(kNumClothPatterns), random.uniform(0.05, 0.6));
  materials.trousers =
      cloth(random.chance(0.7) ? 0 : random.index(kNumClothPatterns), random.uniform(0.04, 0.4));
  materials.shoes = parts->plain(SurfaceKind::kOther, random.uniform(0.03, 0.4));
  return materials;
}

// Children have shorter legs, larger heads and are slimmer for their height.
FigureShape shapeOf(const PlannedMover& mover) {
  const double height = FigureShape().height();
  FigureShape shape;
  if (mover.object_class == ObjectClass::kChild) {
    shape.head = static_cast<float>(0.75 + 0.25 * mover.size);
    shape.trunk = static_cast<float>(1.05 * mover.size);
    shape.width = static_cast<float>(0.25 + 0.75 * mover.size);
    const double rest_m = mover.height_m - 0.57 * shape.trunk - 0.27 * shape.head;
    shape.legs = static_cast<float>(rest_m / (height - 0.57 - 0.27));
  } else {
    shape.legs = shape.trunk = shape.head = static_cast<float>(mover.height_m / height);
  }
  return shape;
}

MeshOf meshOf(const PlannedMover& mover, SceneParts* parts) {
  Random random(mover.look);
  if (mover.object_class == ObjectClass::kCar) {
    TriangleMesh car;
    car.append(parts->carMesh(mover.car_shape, random.index(kNumPaints), mover.look),
               placement(-mover.middle_m, 0.0, 0.0, 0.0));
    const auto mesh = std::make_shared<const TriangleMesh>(std::move(car));
    return [mesh](double, double) { return *mesh; };
  }
  const FigureMaterials clothes = dress(mover.look, parts);
  if (mover.object_class == ObjectClass::kBicycle) {
    const BicycleMaterials bicycle{parts->plain(SurfaceKind::kOther, random.uniform(0.05, 0.6), 0.04),
                                   parts->plain(SurfaceKind::kOther, 0.03),
                                   parts->plain(SurfaceKind::kOther, 0.05)};
    return [=](double along_m, double) {
      return makeBicycle(bicycle, clothes, kTwoPi * along_m / kCrankTurn_m);
    };
  }
  const FigureShape shape = shapeOf(mover);
  return [=](double along_m, double speed_m_per_s) {
    return makeFigure(clothes, std::min(1.0, speed_m_per_s / kWalking_m_per_s),
                      kTwoPi * along_m / shape.stride(), shape);
  };
}

// Lamp light is baked into vertices; that of movers follows the light on the floor where they are.
void takeLightOfFloor(const GroundTexture& floor, const Eigen::Vector3d& position_m, TriangleMesh* mesh) {
  const float light =
      floor.sampleAt(static_cast<float>(position_m.x()), static_cast<float>(position_m.y()), 1.0F);
  for (MeshVertex& vertex : mesh->vertices) {
    vertex.ambient *= light * (0.6F + 0.4F * vertex.normal.z());
  }
}

Mover makeMover(const PlannedMover& planned, int number, double start_s, SceneParts* parts) {
  const auto mover = std::make_shared<const PlannedMover>(planned);
  const MeshOf mesh_of = meshOf(planned, parts);
  const Scene* scene = &parts->scene();
  return {nameOf(planned.object_class) + "_" + std::to_string(number), planned.object_class,
          [=](double time_s) { return mover->stateAt(time_s - start_s); },
          [=](double time_s) {
            const auto [along_m, speed_m_per_s] = mover->schedule->at(time_s - start_s);
            const RigidTransform pose = mover->poseAt(along_m);
            const Eigen::Vector3d& position_m = pose.translation();
            TriangleMesh mesh;
            mesh.append(
                mesh_of(mover->start_m + along_m, speed_m_per_s),
                placement(position_m.x(), position_m.y(), position_m.z(), yawOfRotation(pose.rotation())));
            if (scene->ceiling && scene->ground.surrounding) {
              takeLightOfFloor(*scene->ground.surrounding, position_m, &mesh);
            }
            return mesh;
          }};
}

}  // namespace

void addMovers(const SceneOptions& options, const MoverArea& area, SceneParts* parts) {
  if (!options.movers.hasAny()) {
    return;
  }
  const OwnCar own_car(options.own_poses);
  std::map<ObjectClass, int> numbers;
  for (const PlannedMover& planned :
       planMovers(options.movers, area, parts->scene(), own_car, options.start_s)) {
    parts->scene().movers.push_back(
        makeMover(planned, ++numbers[planned.object_class], options.start_s, parts));
  }
}

}  // namespace vcharge
