#include <algorithm>
#include <memory>
#include <string>
#include <vector>

#include <benchmark/benchmark.h>
#include <tbb/global_control.h>

#include "vcharge_simulation/drive/drive_simulator.h"
#include "vcharge_simulation/rendering/renderer.h"
#include "vcharge_simulation/scenes/scene_catalogue.h"
#include "vcharge_simulation/sensors/golf_rig.h"

namespace vcharge {
namespace {

const Renderer& rendererOf(const std::string& scene, const std::string& drive, const MoverOptions& movers,
                           ConditionKind condition) {
  static std::string built;
  static std::unique_ptr<const Renderer> renderer;
  const std::string name =
      scene + (movers.hasAny() ? " with movers " : " ") + std::to_string(static_cast<int>(condition));
  if (name != built) {
    renderer.reset();
    SceneOptions options;
    options.movers = movers;
    options.condition.kind = condition;
    const DrivePlan plan = planDrive(scene, drive);
    options.own_poses = ownPoses(simulateDrive(plan.path, plan.motion, WheelOdometerOptions(), 1, 1,
                                               FaultOptions(), plan.ground_height));
    renderer = std::make_unique<const Renderer>(buildScene(scene, options));
    built = name;
  }
  return *renderer;
}

MoverOptions tenMovers() {
  MoverOptions movers;
  movers.people = 4;
  movers.children = movers.cars = movers.bicycles = 2;
  return movers;
}

// Renders one 1280x800 image at four rays per pixel on one core, at the start of a drive at 2.5 m/s.
void renderImage(benchmark::State& state, const std::string& scene, const std::string& drive,
                 double readout_time_s = 0.0, const MoverOptions& movers = MoverOptions(),
                 ConditionKind condition = ConditionKind::kNoon) {
  const Renderer& renderer = rendererOf(scene, drive, movers, condition);
  const auto body = makeGolfBody();
  const DrivePlan plan = planDrive(scene, drive);
  const RigidTransform& start = plan.path.worldFromStart();
  const double lift_m =
      plan.ground_height ? plan.ground_height(start.translation().x(), start.translation().y()) : 0.0;
  const RigidTransform world_from_vehicle(start.rotation(),
                                          start.translation() + Eigen::Vector3d(0.0, 0.0, lift_m));
  const tbb::global_control limit(tbb::global_control::max_allowed_parallelism, 1);
  const CameraView view(makeGolfRig(1, 1.0).cameras[static_cast<size_t>(state.range(0))], body);
  std::vector<RigidTransform> poses;
  for (int ms = -20; ms <= 20; ++ms) {
    poses.push_back(world_from_vehicle * RigidTransform::planar(2.5e-3 * ms, 0.0, 0.0));
  }
  const Readout readout(MotionWindow(poses), readout_time_s);
  for (auto _ : state) {
    benchmark::DoNotOptimize(renderer.renderLight(view, readout, plan.start_s).data);
  }
  state.counters["images"] = benchmark::Counter(1.0, benchmark::Counter::kIsIterationInvariantRate);
}

void renderCondition(benchmark::State& state, const std::string& scene, const std::string& drive,
                     ConditionKind condition) {
  renderImage(state, scene, drive, 0.0, MoverOptions(), condition);
}

// The minimum is reported because other load on the machine only adds time.
double minimum(const std::vector<double>& times) {
  return *std::min_element(times.begin(), times.end());
}

void oneThread(benchmark::internal::Benchmark* images) {
  images->Unit(benchmark::kMillisecond)->ComputeStatistics("min", minimum);
}

BENCHMARK_CAPTURE(renderImage, lot, "lot", "short")->DenseRange(0, 3)->Apply(oneThread);
BENCHMARK_CAPTURE(renderImage, lot_rolling_20_ms, "lot", "short", 0.02)->DenseRange(0, 3)->Apply(oneThread);
BENCHMARK_CAPTURE(renderImage, lot_with_movers, "lot", "standing", 0.0, tenMovers())
    ->DenseRange(0, 3)
    ->Apply(oneThread);
BENCHMARK_CAPTURE(renderCondition, lot_noon, "lot", "short", ConditionKind::kNoon)->Arg(0)->Apply(oneThread);
BENCHMARK_CAPTURE(renderCondition, lot_low_sun, "lot", "short", ConditionKind::kLowSun)
    ->Arg(0)
    ->Apply(oneThread);
BENCHMARK_CAPTURE(renderCondition, lot_overcast, "lot", "short", ConditionKind::kOvercast)
    ->Arg(0)
    ->Apply(oneThread);
BENCHMARK_CAPTURE(renderCondition, lot_dusk, "lot", "short", ConditionKind::kDusk)->Arg(0)->Apply(oneThread);
BENCHMARK_CAPTURE(renderCondition, lot_night, "lot", "short", ConditionKind::kNight)
    ->Arg(0)
    ->Apply(oneThread);
BENCHMARK_CAPTURE(renderCondition, lot_wet, "lot", "short", ConditionKind::kWet)->Arg(0)->Apply(oneThread);
BENCHMARK_CAPTURE(renderCondition, garage_noon, "garage", "loop", ConditionKind::kNoon)
    ->Arg(0)
    ->Apply(oneThread);
BENCHMARK_CAPTURE(renderCondition, garage_night, "garage", "loop", ConditionKind::kNight)
    ->Arg(0)
    ->Apply(oneThread);
BENCHMARK_CAPTURE(renderCondition, garage_wet, "garage", "loop", ConditionKind::kWet)
    ->Arg(0)
    ->Apply(oneThread);
BENCHMARK_CAPTURE(renderImage, garage, "garage", "loop")->DenseRange(0, 3)->Apply(oneThread);
BENCHMARK_CAPTURE(renderImage, obstacles, "obstacles", "creep")->Arg(1)->Apply(oneThread);
BENCHMARK_CAPTURE(renderImage, two_levels, "two_levels", "up_and_down")->Arg(1)->Apply(oneThread);
BENCHMARK_CAPTURE(renderImage, chessboard, "chessboard", "board_left")->Arg(1)->Apply(oneThread);

}  // namespace
}  // namespace vcharge

BENCHMARK_MAIN();
