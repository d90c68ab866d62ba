// Times the plane sweep, a memory benchmark and the plain reference: 640x400 pixels, ZNCC 7x7, 64
// planes, 4 neighbours. Items are pixels times planes times images, or gathered pixels. --smoke runs
// everything once on a small image.
#include <algorithm>
#include <string>
#include <vector>

#include <benchmark/benchmark.h>
#include <hwy/targets.h>
#include <tbb/global_control.h>

#include "machine_limits.h"
#include "reference/analytic_scene.h"
#include "reference/plain_plane_sweep.h"
#include "refinement/surface_estimate.h"
#include "sweep/sweep_input.h"
#include "sweep/tile_scorer.h"
#include "vcharge_dense/plane_sweep.h"
#include "vcharge_dense/range_mapper.h"

namespace vcharge {
namespace {

cv::Size image_size(640, 400);  // a smoke test uses a smaller size

constexpr size_t kGatherRows = 64, kGatherColumns = 640;
const MeiCamera kFisheye(1.158, 448.0, 447.0, 324.0, 199.0);
const MeiCamera kPinhole(0.0, 330.0, 330.0, 324.0, 199.0);

/// A side camera that passes a wall and a box; images every 0.2 m, all taken before the reference.
struct Scene {
  MeiCamera camera;
  SweepImage reference;
  std::vector<SweepImage> neighbours;
  Plane ground;

  Scene(const MeiCamera& model, int num_neighbours) : camera(model) {
    const AnalyticScene world(
        {{{0, 0, 0}, {0, 0, 1}}, {{0, 6.5, 0}, {0, -1, 0}}, {{1.5, 3.5, 0.6}, {0, -1, 0}, {1.0, 0.0, 0.6}}},
        7);
    const Eigen::Quaterniond vehicle_from_optical(0.5, -0.5, 0.5, -0.5);
    const Eigen::Quaterniond rotation = rotationFromYawPitchRoll(1.5, 0.6, 0.0) * vehicle_from_optical;
    for (int i = 0; i <= num_neighbours; ++i) {
      const RigidTransform pose(rotation, Eigen::Vector3d(-0.2 * i, 1.0, 0.9));
      SweepImage image{Timestamp::fromNanoseconds(1000000000 - i * 80000000),
                       world.render(camera, image_size, pose, 1.0, static_cast<uint32_t>(1 + i)), pose};
      i == 0 ? void(reference = image) : neighbours.push_back(image);
    }
    ground = groundInCamera(reference.world_from_camera);
  }
};

const Scene& scene(bool fisheye) {
  static const Scene fisheye_scene(kFisheye, 4);
  static const Scene pinhole_scene(kPinhole, 4);
  return fisheye ? fisheye_scene : pinhole_scene;
}

PlaneSweepOptions firstSweepOnly() {
  PlaneSweepOptions options;
  options.num_ground_planes = 0;
  options.num_refinement_steps = 0;
  return options;
}

/// Restricts Highway to one instruction set during its lifetime; works() is false where the machine lacks it.
class OnlyTarget {
 public:
  OnlyTarget(benchmark::State* state, int64_t target) : works_((hwy::SupportedTargets() & target) != 0) {
    if (works_) {
      hwy::SetSupportedTargetsForTest(target);
    } else {
      state->SkipWithError("the processor lacks this instruction set");
    }
  }
  ~OnlyTarget() { hwy::SetSupportedTargetsForTest(0); }
  OnlyTarget(const OnlyTarget&) = delete;
  OnlyTarget& operator=(const OnlyTarget&) = delete;
  bool works() const { return works_; }

 private:
  bool works_;
};

void gather(benchmark::State& state, int64_t target) {
  const OnlyTarget only(&state, target);
  const std::vector<int32_t> image(1024 * (kGatherRows + 8), 1);
  for (auto _ : state) {
    benchmark::DoNotOptimize(gatherPixels(image.data(), kGatherRows, kGatherColumns));
  }
  state.SetItemsProcessed(state.iterations() * static_cast<int64_t>(kGatherRows * kGatherColumns));
}

int64_t itemsPerSweep(int num_planes) {
  return static_cast<int64_t>(image_size.area()) * num_planes *
         static_cast<int64_t>(scene(true).neighbours.size());
}

/// Times the first sweep: matching, aggregation and the two best peaks of every pixel.
void kernel(benchmark::State& state, int64_t target, bool fisheye) {
  const OnlyTarget only(&state, target);
  if (!only.works()) {
    return;
  }
  const Scene& s = scene(fisheye);
  const PlaneSweepOptions options = firstSweepOnly();
  const cv::Mat valid(image_size, CV_8UC1, cv::Scalar(255));
  const RayTable rays(s.camera, image_size, 6.283185307179586);
  const Hypotheses planes =
      makePlaneHypotheses(makePlaneFamilies(options, std::nullopt).front(), rays, valid);
  const SampleScale scale = SampleScale::forWindow(kMatchingWindow_px);
  const std::vector<cv::Rect> tiles = makeTiles(image_size);
  for (auto _ : state) {
    SweepInput input{s.camera,
                     &rays,
                     &valid,
                     &options,
                     sweepKernels(),
                     scale,
                     SweepReference(s.reference.pixels, options, scale),
                     {}};
    for (const SweepImage& image : s.neighbours) {
      const RigidTransform from_reference = image.world_from_camera.inverse() * s.reference.world_from_camera;
      input.neighbours.push_back({PackedImage(image.pixels, valid), s.camera,
                                  from_reference.rotationMatrix().cast<float>(),
                                  from_reference.translation().cast<float>(), false});
    }
    TileScorer scorer;
    TileScores scores;
    for (const cv::Rect& tile : tiles) {
      scorer.setTile(input, tile);
      scorer.score(planes, &scores);
      benchmark::DoNotOptimize(scores.best.data());
    }
  }
  state.SetItemsProcessed(state.iterations() * itemsPerSweep(options.num_planes));
}

void plain(benchmark::State& state) {
  const Scene& s = scene(true);
  PlaneSweepOptions options = firstSweepOnly();
  options.num_planes = 4;
  const cv::Mat valid(image_size, CV_8UC1, cv::Scalar(255));
  const auto families = makePlaneFamilies(options, std::nullopt);
  for (auto _ : state) {
    benchmark::DoNotOptimize(plainPlaneSweep(s.camera, valid, families, options, s.reference, s.neighbours,
                                             PlainBorder::kUnknown));
  }
  state.SetItemsProcessed(state.iterations() * itemsPerSweep(options.num_planes));
}

/// Times a complete range map, from images to ranges.
void rangeMap(benchmark::State& state, int ground_planes, int refinement_steps, size_t num_neighbours,
              bool coarse_pass) {
  const tbb::global_control control(tbb::global_control::max_allowed_parallelism,
                                    static_cast<size_t>(state.range(0)));
  const Scene& s = scene(true);
  PlaneSweepOptions options;
  options.num_ground_planes = ground_planes;
  options.num_refinement_steps = refinement_steps;
  options.coarse_pass = coarse_pass;
  const cv::Mat valid(image_size, CV_8UC1, cv::Scalar(255));
  const PlaneSweep sweep(s.camera, valid, options, s.ground);
  const std::vector<SweepImage> neighbours(
      s.neighbours.begin(), s.neighbours.begin() + static_cast<std::ptrdiff_t>(num_neighbours));
  for (auto _ : state) {
    benchmark::DoNotOptimize(sweep.sweep(s.reference, neighbours));
  }
}

enum class Search { kAllPlanes, kCoarsePass, kRemembering };

/// Times a range map with the numbers of planes of the preset `fast`. The remembered one is of the image
/// before.
void fastRangeMap(benchmark::State& state, Search search) {
  const tbb::global_control control(tbb::global_control::max_allowed_parallelism,
                                    static_cast<size_t>(state.range(0)));
  const Scene& s = scene(true);
  RangeMapperOptions options;
  options.usePreset(RangePreset::kFast);
  options.plane_sweep.coarse_pass = search != Search::kAllPlanes;
  const cv::Mat valid(image_size, CV_8UC1, cv::Scalar(255));
  const PlaneSweep sweep(s.camera, valid, options.plane_sweep, s.ground);
  RememberedRanges remembered{
      sweep.sweep(s.neighbours.front(), {s.neighbours.begin() + 1, s.neighbours.end()}).range_m,
      s.neighbours.front().world_from_camera, 0};
  for (auto _ : state) {
    ++remembered.num_sweeps;
    benchmark::DoNotOptimize(sweep.sweep(s.reference, s.neighbours, nullptr,
                                         search == Search::kRemembering ? &remembered : nullptr));
  }
}

void onOneAndTwoThreads(benchmark::internal::Benchmark* b) {
  b->Arg(1)->Arg(2)->MeasureProcessCPUTime()->UseRealTime()->Unit(benchmark::kMillisecond);
}

BENCHMARK_CAPTURE(gather, avx3, HWY_AVX3);
BENCHMARK_CAPTURE(gather, avx2, HWY_AVX2);
BENCHMARK_CAPTURE(kernel, avx3_fisheye, HWY_AVX3, true)->Unit(benchmark::kMillisecond);
BENCHMARK_CAPTURE(kernel, avx3_pinhole, HWY_AVX3, false)->Unit(benchmark::kMillisecond);
BENCHMARK_CAPTURE(kernel, avx2_fisheye, HWY_AVX2, true)->Unit(benchmark::kMillisecond);
BENCHMARK_CAPTURE(kernel, avx2_pinhole, HWY_AVX2, false)->Unit(benchmark::kMillisecond);
BENCHMARK(plain)->Iterations(1)->Unit(benchmark::kMillisecond);
BENCHMARK_CAPTURE(rangeMap, first_sweep_of_4, 0, 0, 4, false)->Apply(onOneAndTwoThreads);
BENCHMARK_CAPTURE(rangeMap, first_sweep_of_2, 0, 0, 2, false)->Apply(onOneAndTwoThreads);
BENCHMARK_CAPTURE(rangeMap, whole_of_4, 16, 16, 4, false)->Apply(onOneAndTwoThreads);
BENCHMARK_CAPTURE(rangeMap, whole_of_2, 16, 16, 2, false)->Apply(onOneAndTwoThreads);
BENCHMARK_CAPTURE(rangeMap, coarse_and_whole_of_4, 16, 16, 4, true)->Apply(onOneAndTwoThreads);
BENCHMARK_CAPTURE(rangeMap, coarse_and_whole_of_2, 16, 16, 2, true)->Apply(onOneAndTwoThreads);
BENCHMARK_CAPTURE(fastRangeMap, all_planes, Search::kAllPlanes)->Apply(onOneAndTwoThreads);
BENCHMARK_CAPTURE(fastRangeMap, coarse_pass, Search::kCoarsePass)->Apply(onOneAndTwoThreads);
BENCHMARK_CAPTURE(fastRangeMap, remembering, Search::kRemembering)->Apply(onOneAndTwoThreads);

}  // namespace
}  // namespace vcharge

int main(int argc, char** argv) {
  std::vector<char*> arguments(argv, argv + argc);
  const auto smoke = std::find_if(arguments.begin(), arguments.end(),
                                  [](const char* a) { return std::string(a) == "--smoke"; });
  std::string min_time = "--benchmark_min_time=0.001";
  if (smoke != arguments.end()) {
    vcharge::image_size = cv::Size(96, 80);
    *smoke = min_time.data();
  }
  auto count = static_cast<int>(arguments.size());
  benchmark::Initialize(&count, arguments.data());
  if (benchmark::ReportUnrecognizedArguments(count, arguments.data())) {
    return 1;
  }
  return benchmark::RunSpecifiedBenchmarks() > 0 ? 0 : 1;
}
