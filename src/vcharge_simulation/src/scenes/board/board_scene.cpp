#include <algorithm>
#include <memory>

#include "scenes/board/board_motion.h"
#include "scenes/board/board_pattern.h"
#include "scenes/lot/lot_variant.h"
#include "scenes/scene_builders.h"
#include "scenes/scene_parts.h"
#include "vcharge_simulation/sensors/golf_rig.h"
#include "vcharge_simulation/sensors/rig_catalogue.h"

namespace vcharge {

namespace {

constexpr double kFreeRadius_m = 9.0;

const RigidTransform& worldFromVehicle() {
  static const RigidTransform pose = RigidTransform::planar(-5.0, 0.2, 0.1);
  return pose;
}

struct Board {
  BoardPattern pattern;
  BoardMotion motion;
  uint32_t front, back;  // indices of materials
};

constexpr double kThickness_m = 0.01;

Eigen::Vector3d cornerOf(const Board& board, const RigidTransform& world_from_sheet, double x, double y,
                         double z_m) {
  return world_from_sheet *
         Eigen::Vector3d(0.5 * x * board.pattern.size_m.x(), 0.5 * y * board.pattern.size_m.y(), z_m);
}

TriangleMesh meshOf(const Board& board, double time_s) {
  const RigidTransform world_from_sheet = board.motion.worldFromSheet(time_s);
  const auto corner = [&](double x, double y, double z_m) {
    return cornerOf(board, world_from_sheet, x, y, z_m).cast<float>().eval();
  };
  TriangleMesh mesh;
  // The viewer is at negative z, and image rows grow with y.
  addQuad(corner(-1, 1, 0), corner(1, 1, 0), corner(1, -1, 0), corner(-1, -1, 0), board.front, &mesh);
  addQuad(corner(1, 1, kThickness_m), corner(-1, 1, kThickness_m), corner(-1, -1, kThickness_m),
          corner(1, -1, kThickness_m), board.back, &mesh);
  return mesh;
}

MoverState boardAt(const Board& board, double time_s) {
  const RigidTransform world_from_sheet = board.motion.worldFromSheet(time_s);
  Eigen::AlignedBox3d box;
  for (const double x : {-1.0, 1.0}) {
    for (const double y : {-1.0, 1.0}) {
      for (const double z_m : {0.0, kThickness_m}) {
        box.extend(cornerOf(board, world_from_sheet, x, y, z_m));
      }
    }
  }
  MoverState state;
  state.world_from_mover = world_from_sheet * board.pattern.sheet_from_pattern;
  state.obstacle = {"board", cornersOf({box.min().x(), box.min().y(), box.max().x(), box.max().y()}),
                    box.min().z(), box.max().z()};
  return state;
}

}  // namespace

std::shared_ptr<const Scene> buildBoardScene(const SceneOptions& options) {
  LotVariant variant;
  variant.layout = makeLotLayout(options.seed, options.day);
  // Keeps the area around the car free for the board.
  const Eigen::Vector2d position = worldFromVehicle().translation().head<2>();
  variant.layout.cars.erase(std::remove_if(variant.layout.cars.begin(), variant.layout.cars.end(),
                                           [&](const ParkedCar& car) {
                                             return (Eigen::Vector2d(car.x, car.y) - position).norm() <
                                                    kFreeRadius_m;
                                           }),
                            variant.layout.cars.end());
  const BoardPattern pattern = makeBoardPattern(options.board);
  const BoardMotion motion(makeRig(options.rig, options.rig_seed, 1.0), *makeGolfBody(), pattern.size_m,
                           worldFromVehicle(), options.seed);
  variant.add_things = [&](SceneParts* parts) {
    const uint32_t front = parts->textured(SurfaceKind::kOther, pattern.image, pattern.texels_per_m);
    const uint32_t back = parts->plain(SurfaceKind::kOther, 0.3);
    const auto board = std::make_shared<const Board>(Board{pattern, motion, front, back});
    parts->scene().movers.push_back({"board", ObjectClass::kUnknown,
                                     [board](double time_s) { return boardAt(*board, time_s); },
                                     [board](double time_s) { return meshOf(*board, time_s); }});
  };
  return buildLotVariant(options, variant);
}

std::vector<SceneDrive> boardDrives() {
  std::vector<SceneDrive> drives;
  for (const std::string camera : {"front", "left", "rear", "right"}) {
    const double start_s = BoardMotion::kSpan_s * static_cast<double>(drives.size());
    drives.push_back(
        {{"board_" + camera, "40 s of the board in front of the camera " + camera + ", at standstill"},
         [start_s] {
           VehicleMotionOptions motion;
           motion.standstill_s = motion.duration_s = BoardMotion::kSpan_s;
           return DrivePlan{"",     DrivePath(worldFromVehicle(), {{1.0, 0.0, 0.0}}), motion, 0, nullptr,
                            start_s};
         }});
  }
  return drives;
}

}  // namespace vcharge
