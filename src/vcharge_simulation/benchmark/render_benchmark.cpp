#include <benchmark/benchmark.h>
#include <tbb/global_control.h>

#include "vcharge_simulation/golf_rig.h"
#include "vcharge_simulation/lot_scene.h"
#include "vcharge_simulation/renderer.h"

namespace vcharge {
namespace {

// One 1280x800 image of the lot at four rays per pixel, on one core.
void renderImage(benchmark::State& state) {
  static const Renderer renderer(buildLotScene(LotOptions()));
  static const auto body = makeGolfBody();
  const tbb::global_control limit(tbb::global_control::max_allowed_parallelism, 1);
  const CameraView view(makeGolfRig(1, 1.0).cameras[static_cast<size_t>(state.range(0))], body);
  for (auto _ : state) {
    benchmark::DoNotOptimize(renderer.renderLight(view, RigidTransform::planar(-5.0, 0.2, 0.1)).data);
  }
}
BENCHMARK(renderImage)->DenseRange(0, 3)->Unit(benchmark::kMillisecond);

}  // namespace
}  // namespace vcharge

BENCHMARK_MAIN();
