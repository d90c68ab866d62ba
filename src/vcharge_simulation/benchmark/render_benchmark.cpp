#include <algorithm>
#include <memory>
#include <string>
#include <vector>

#include <benchmark/benchmark.h>
#include <tbb/global_control.h>

#include "vcharge_simulation/rendering/renderer.h"
#include "vcharge_simulation/scenes/scene_catalogue.h"
#include "vcharge_simulation/sensors/golf_rig.h"

namespace vcharge {
namespace {

const Renderer& rendererOf(const std::string& scene) {
  static std::string built;
  static std::unique_ptr<const Renderer> renderer;
  if (scene != built) {
    renderer.reset();
    renderer = std::make_unique<const Renderer>(buildScene(scene, SceneOptions()));
    built = scene;
  }
  return *renderer;
}

// Renders one 1280x800 image at four rays per pixel on one core, at the start of a drive at 2.5 m/s.
void renderImage(benchmark::State& state, const std::string& scene, const std::string& drive,
                 double readout_time_s) {
  const Renderer& renderer = rendererOf(scene);
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
}
// The minimum is reported because other load on the machine only adds time.
double minimum(const std::vector<double>& times) {
  return *std::min_element(times.begin(), times.end());
}

void oneThread(benchmark::internal::Benchmark* images) {
  images->Unit(benchmark::kMillisecond)->ComputeStatistics("min", minimum);
}

BENCHMARK_CAPTURE(renderImage, lot, "lot", "short", 0.0)->DenseRange(0, 3)->Apply(oneThread);
BENCHMARK_CAPTURE(renderImage, lot_rolling_20_ms, "lot", "short", 0.02)->DenseRange(0, 3)->Apply(oneThread);
BENCHMARK_CAPTURE(renderImage, garage, "garage", "loop", 0.0)->DenseRange(0, 3)->Apply(oneThread);
BENCHMARK_CAPTURE(renderImage, obstacles, "obstacles", "creep", 0.0)->Arg(1)->Apply(oneThread);
BENCHMARK_CAPTURE(renderImage, two_levels, "two_levels", "up_and_down", 0.0)->Arg(1)->Apply(oneThread);
BENCHMARK_CAPTURE(renderImage, chessboard, "chessboard", "board_left", 0.0)->Arg(1)->Apply(oneThread);

}  // namespace
}  // namespace vcharge

BENCHMARK_MAIN();
