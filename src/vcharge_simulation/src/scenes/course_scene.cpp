#include <algorithm>
#include <cmath>

#include "objects/figure.h"
#include "scenes/lane_paths.h"
#include "scenes/lot/lot_variant.h"
#include "scenes/scene_builders.h"
#include "scenes/scene_parts.h"
#include "vcharge_simulation/objects/car_model.h"

namespace vcharge {

namespace {

constexpr double kPi = 3.14159265358979323846;
constexpr double kWalkLine_m = 3.6;    // y of the walker's line
constexpr double kWalkReach_m = 15.0;  // distance from the middle at which the walker turns around
constexpr double kWalkSpeed_m_per_s = 1.2;
constexpr double kTurn_s = 0.8;

bool isOnCourse(double x, double y) {
  return std::abs(x) < 22.0 && std::abs(y) < 7.5;
}

FigureMaterials addFigureMaterials(double jacket, double trousers, SceneParts* parts) {
  FigureMaterials figure{};
  figure.skin = parts->plain(SurfaceKind::kOther, 0.35);
  figure.jacket =
      parts->textured(SurfaceKind::kOther, parts->noiseImage(64, 128, jacket, 0.35, 0.12, 0.1), 120.0);
  figure.trousers =
      parts->textured(SurfaceKind::kOther, parts->noiseImage(64, 128, trousers, 0.3, 0.12, 0.1), 120.0);
  figure.shoes = parts->plain(SurfaceKind::kOther, 0.04);
  return figure;
}

void addBoxes(SceneParts* parts) {
  Random& random = parts->random();
  const uint32_t cardboard =
      parts->textured(SurfaceKind::kOther, parts->noiseImage(128, 128, 0.3, 0.25, 0.05, 0.2), 200.0);
  const uint32_t crate =
      parts->textured(SurfaceKind::kOther, parts->noiseImage(128, 128, 0.14, 0.6, 0.3, 0.02), 200.0);
  int number = 0;
  for (const double size : {0.2, 0.3, 0.45, 0.6, 0.25, 0.5}) {
    const double x = -15.0 + 5.5 * number;
    const double y = (number % 2 == 0 ? 1.0 : -1.0) * random.uniform(1.5, 2.2);
    const double yaw_rad = random.uniform(0.0, kPi);
    const double depth = size * random.uniform(0.7, 1.0);
    const double height = size * random.uniform(0.7, 1.0);
    addBox(placement(x, y, 0.5 * height, yaw_rad), Eigen::Vector3d(size, depth, height).cast<float>(),
           number % 2 == 0 ? cardboard : crate, &parts->scene().mesh);
    parts->scene().obstacles.push_back(
        {"box", orientedRectangle(x, y, yaw_rad, -0.5 * size, 0.5 * size, 0.5 * depth), 0.0, height});
    ++number;
  }
}

// Posts with diameters of 5 to 15 cm.
void addPosts(SceneParts* parts) {
  parts->addPoles({{-17.5, -1.7, 0.0, 1.0, 0.025, false},
                   {-12.2, 1.5, 0.0, 0.9, 0.03, false},
                   {-7.0, -2.0, 0.0, 1.1, 0.04, false},
                   {-1.8, 1.6, 0.0, 0.6, 0.05, false},
                   {3.6, -1.6, 0.0, 0.8, 0.06, false},
                   {8.8, 2.2, 0.0, 1.0, 0.075, false},
                   {14.5, 1.5, 0.0, 0.5, 0.075, false}});
}

// A trailer whose bar hangs over the lane at a height of 0.4 m, so that its shadow is beside it.
void addTrailer(SceneParts* parts) {
  constexpr double kX_m = 5.5;
  const uint32_t paint = parts->plain(SurfaceKind::kOther, 0.3, 0.03);
  const uint32_t canvas =
      parts->textured(SurfaceKind::kOther, parts->noiseImage(256, 128, 0.3, 0.3, 0.04, 0.02), 100.0);
  const uint32_t tyre = parts->plain(SurfaceKind::kOther, 0.035);
  TriangleMesh* mesh = &parts->scene().mesh;
  addBox(placement(kX_m, 4.6, 0.85, 0.0), {1.3F, 2.0F, 0.8F}, canvas, mesh);
  addBox(placement(kX_m, 4.6, 0.42, 0.0), {1.2F, 1.9F, 0.08F}, paint, mesh);
  for (const float side : {-1.0F, 1.0F}) {
    const Eigen::Vector3f hub(static_cast<float>(kX_m) + 0.68F * side, 4.7F, 0.28F);
    addFrustum(hub - Eigen::Vector3f(0.08F, 0.0F, 0.0F), hub + Eigen::Vector3f(0.08F, 0.0F, 0.0F), 0.28F,
               0.28F, 20, true, tyre, mesh);
  }
  const auto x = static_cast<float>(kX_m);
  addFrustum({x, 3.6F, 0.43F}, {x, 1.9F, 0.43F}, 0.035F, 0.035F, 10, true, paint, mesh);
  addFrustum({x, 2.05F, 0.0F}, {x, 2.05F, 0.43F}, 0.03F, 0.03F, 10, true, paint, mesh);
  parts->scene().obstacles.push_back(
      {"trailer", orientedRectangle(kX_m, 4.6, 0.0, -0.76, 0.76, 1.0), 0.0, 1.25});
  parts->scene().obstacles.push_back(
      {"trailer_bar", orientedRectangle(kX_m, 2.75, 0.0, -0.035, 0.035, 0.85), 0.395, 0.465});
}

void addStandingFigure(SceneParts* parts) {
  const FigureMaterials materials = addFigureMaterials(0.32, 0.08, parts);
  parts->scene().mesh.append(makeFigure(materials, 0.0, 0.0), placement(-4.5, 2.3, 0.0, -1.2));
  parts->scene().obstacles.push_back(
      {"pedestrian", circleAround(-4.5, 2.3, kFigureRadius_m), 0.0, kFigureHeight_m});
}

// The walker goes back and forth with a turn at each end.
struct Walk {
  explicit Walk(double time_s) {
    const double leg_s = 2.0 * kWalkReach_m / kWalkSpeed_m_per_s;
    const double period_s = 2.0 * (leg_s + kTurn_s);
    const double in_period_s = time_s - period_s * std::floor(time_s / period_s);
    const bool returns = in_period_s >= 0.5 * period_s;
    const double in_leg_s = in_period_s - (returns ? 0.5 * period_s : 0.0);
    walked_m = kWalkSpeed_m_per_s * std::min(in_leg_s, leg_s);
    const double turned = std::max(0.0, (in_leg_s - leg_s) / kTurn_s);
    x = returns ? walked_m - kWalkReach_m : kWalkReach_m - walked_m;
    yaw_rad = kPi * ((returns ? 0.0 : 1.0) + turned);
    speed_m_per_s = in_leg_s < leg_s ? kWalkSpeed_m_per_s : 0.0;
    // Arms and legs stop swinging for the turn.
    swing = std::clamp(2.0 * std::min(in_leg_s, leg_s - in_leg_s), 0.0, 1.0);
  }
  double walked_m, x, yaw_rad, speed_m_per_s, swing;
};

TriangleMesh walkerMesh(const FigureMaterials& materials, double time_s) {
  const Walk walk(time_s);
  TriangleMesh mesh;
  mesh.append(makeFigure(materials, walk.swing, 2.0 * kPi * walk.walked_m / kFigureStride_m),
              placement(walk.x, kWalkLine_m, 0.0, walk.yaw_rad));
  return mesh;
}

MoverState walkerAt(double time_s) {
  const Walk walk(time_s);
  MoverState state;
  state.world_from_mover = RigidTransform::planar(walk.x, kWalkLine_m, walk.yaw_rad);
  state.velocity_m_per_s = state.world_from_mover.rotation() * Eigen::Vector3d(walk.speed_m_per_s, 0.0, 0.0);
  state.is_standing = walk.speed_m_per_s == 0.0;
  state.obstacle = {"pedestrian", circleAround(walk.x, kWalkLine_m, kFigureRadius_m), 0.0, kFigureHeight_m};
  return state;
}

ParkedCar parkedAcross(double x, double y, double yaw_rad, int shape, int paint) {
  ParkedCar car{};
  car.x = x;
  car.y = y;
  car.yaw_rad = yaw_rad;
  car.shape = shape;
  car.paint = paint;
  car.seed = static_cast<uint32_t>(100 * shape + paint);
  return car;
}

LotLayout courseLayout(const SceneOptions& options) {
  LotLayout layout = makeLotLayout(options.seed, options.day);
  layout.cars.erase(std::remove_if(layout.cars.begin(), layout.cars.end(),
                                   [](const ParkedCar& car) { return isOnCourse(car.x, car.y); }),
                    layout.cars.end());
  // Cars with a corner towards the lane.
  layout.cars.push_back(parkedAcross(-9.0, -5.2, 0.9, 1, 3));
  layout.cars.push_back(parkedAcross(11.5, -3.6, 2.7, 4, 2));
  layout.cars.push_back(parkedAcross(0.5, -6.3, 1.1, 0, 4));
  layout.cars.push_back(parkedAcross(18.0, 5.5, -2.1, 5, 1));
  layout.islands.push_back({-9.5, 1.45, -6.5, 1.85});
  layout.islands.push_back({1.0, 1.5, 3.2, 2.6});
  layout.islands.push_back({-14.0, -2.6, -12.5, -1.5});
  layout.islands.push_back({6.5, -1.9, 9.5, -1.5});
  return layout;
}

DrivePlan creep(bool backwards) {
  const double k = 1.0 / 100.0;
  std::vector<DrivePath::Segment> segments;
  for (const double sign : {1.0, -1.0, -1.0, 1.0}) {
    segments.push_back({4.4, 0.0, sign * k, backwards});
    segments.push_back({4.4, sign * k, 0.0, backwards});
  }
  return {"", DrivePath(RigidTransform::planar(backwards ? 17.0 : -19.0, 0.0, 0.0), segments),
          fromRestToRest(0.7)};
}

DrivePlan stand() {
  VehicleMotionOptions motion = fromRestToRest(0.7);
  motion.standstill_s = motion.duration_s = 20.0;
  return {"", DrivePath(RigidTransform::planar(-5.0, 0.0, 0.0), {{1.0, 0.0, 0.0}}), motion};
}

}  // namespace

std::shared_ptr<const Scene> buildCourseScene(const SceneOptions& options) {
  LotVariant course;
  course.layout = courseLayout(options);
  course.add_things = [](SceneParts* parts) {
    addPosts(parts);
    addBoxes(parts);
    addTrailer(parts);
    addStandingFigure(parts);
    const FigureMaterials walker = addFigureMaterials(0.12, 0.2, parts);
    parts->scene().movers.push_back({"walker", ObjectClass::kAdult, walkerAt,
                                     [walker](double time_s) { return walkerMesh(walker, time_s); }});
  };
  return buildLotVariant(options, course);
}

std::vector<SceneDrive> courseDrives() {
  return {{{"creep", "at 0.7 m/s past all obstacles"}, [] { return creep(false); }},
          {{"creep_back", "the same path backwards"}, [] { return creep(true); }},
          {{"stand", "20 s beside the walker"}, stand}};
}

}  // namespace vcharge
