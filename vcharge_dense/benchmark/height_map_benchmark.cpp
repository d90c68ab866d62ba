// Times the fusion and regularization of a height map: Huber-TV iterations of the kernel and the plain loop,
// and the fusion of columns for several areas and numbers of range maps.
#include <cmath>
#include <memory>
#include <vector>

#include <benchmark/benchmark.h>
#include <tbb/global_control.h>

#include "height_map/plain_height_map.h"
#include "height_map/regularization/height_regularization.h"
#include "height_map/test_views.h"

namespace vcharge {
namespace {

constexpr int kColumns = 1200, kRows = 800;  // 60 x 40 m at 5 cm

struct HuberCase {
  VariationalProblem problem;
  cv::Mat start = cv::Mat(kRows, kColumns, CV_32FC1);

  HuberCase() {
    cv::RNG random(1);
    random.fill(start, cv::RNG::UNIFORM, 0.0, 0.2);
    problem.floor = start - 0.0125;
    problem.ceiling = start + 0.0125;
    problem.below = problem.above = 1.0F;
    problem.epsilon = 0.01F;
    problem.low = -0.5F;
    problem.high = 2.0F;
  }
};

/// Does as many iterations as one call of PrimalDualSolver::iterate().
void BM_HuberIterationPlain(benchmark::State& state) {
  const HuberCase huber;
  PlainPrimalDual plain(huber.problem, huber.start, 0.1);
  for (auto _ : state) {
    for (int i = 0; i < PrimalDualSolver::kIterationsAtOnce; ++i) {
      plain.iterate();
    }
  }
  state.SetItemsProcessed(state.iterations() * kColumns * kRows * PrimalDualSolver::kIterationsAtOnce);
}
BENCHMARK(BM_HuberIterationPlain)->Unit(benchmark::kMillisecond);

/// Argument: number of threads.
void BM_HuberIteration(benchmark::State& state) {
  const tbb::global_control threads(tbb::global_control::max_allowed_parallelism,
                                    static_cast<size_t>(state.range(0)));
  const HuberCase huber;
  PrimalDualSolver solver(huber.problem, huber.start, 0.1);
  for (auto _ : state) {
    solver.iterate();
  }
  state.SetItemsProcessed(state.iterations() * kColumns * kRows * PrimalDualSolver::kIterationsAtOnce);
}
BENCHMARK(BM_HuberIteration)
    ->Arg(1)
    ->Arg(2)
    ->Unit(benchmark::kMillisecond)
    ->MeasureProcessCPUTime()
    ->UseRealTime();

/// Arguments: number of range maps, width of the area in metres. Two cameras face both sides of a vehicle
/// that drives back and forth over an area 40 m high.
void BM_Fusion(benchmark::State& state) {
  const testing::BoxWorld world;
  HeightFusionOptions options;
  std::vector<Eigen::Vector3d> positions;
  Eigen::AlignedBox3d extent_m;
  std::vector<std::shared_ptr<const PackedRangeMap>> maps;
  const auto count = static_cast<int>(state.range(0));
  const double width_m = static_cast<double>(state.range(1)) - 2.0 * options.max_range_m;
  const double height_m = 40.0 - 2.0 * options.max_range_m;
  for (int i = 0; i < count; ++i) {
    const double lane = std::floor(4.0 * i / count);
    const double along = 4.0 * i / count - lane;
    const Eigen::Vector3d position(width_m * along, height_m * lane / 3.0, 1.0);
    const RigidTransform pose = testing::cameraPose(position, i % 2 == 0 ? 1.57 : -1.57, 0.5);
    positions.push_back(position);
    extent_m.extend(Eigen::Vector3d(position.x(), position.y(), 0.0));
    maps.push_back(std::make_shared<const PackedRangeMap>(
        packRangeMap(testing::renderView(world, pose, cv::Size(320, 200)), pose)));
  }
  const VoxelGrid grid = makeVoxelGrid(extent_m, options);
  for (auto _ : state) {
    benchmark::DoNotOptimize(
        fuseColumns(grid, positions, [&](size_t view) { return maps[view]; }, options, {}));
  }
  state.counters["cells"] = static_cast<double>(grid.columns) * grid.rows;
  state.counters["voxels_of_a_column"] = grid.num_voxels;
}
BENCHMARK(BM_Fusion)
    ->Args({75, 60})
    ->Args({150, 60})
    ->Args({300, 60})
    ->Args({150, 38})
    ->Unit(benchmark::kSecond)
    ->Iterations(1)
    ->MeasureProcessCPUTime()
    ->UseRealTime();

}  // namespace
}  // namespace vcharge

BENCHMARK_MAIN();
