// Compares the plane sweep with the limits of the machine and the plain reference in one run: 640x400 pixels,
// ZNCC 7x7, 64 planes, 4 neighbours. Each figure is the minimum over repetitions; --benchmark_filter selects
// some. --smoke runs everything once on a small image and fails where a figure is missing.
#include <algorithm>
#include <cstdio>
#include <ctime>
#include <map>
#include <numeric>
#include <string>
#include <utility>
#include <vector>

#include <benchmark/benchmark.h>
#include <hwy/aligned_allocator.h>
#include <hwy/targets.h>
#include <tbb/global_control.h>

#include "machine_limits.h"
#include "reference/analytic_scene.h"
#include "reference/plain_plane_sweep.h"
#include "refinement/surface_estimate.h"
#include "sweep/sweep_input.h"
#include "sweep/tile_scorer.h"
#include "vcharge_dense/plane_sweep.h"

namespace vcharge {
namespace {

/// Sizes of the measurements, which a smoke test reduces.
struct Sizes {
  cv::Size image = cv::Size(640, 400);
  int num_rounds = 10;
};
Sizes sizes;

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
                       world.render(camera, sizes.image, pose, 1.0, static_cast<uint32_t>(1 + i)), pose};
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

void gather(benchmark::State& state, int64_t target, bool in_turn) {
  const OnlyTarget only(&state, target);
  const std::vector<int32_t> image(1024 * (kGatherRows + 8), 1);
  for (auto _ : state) {
    benchmark::DoNotOptimize(in_turn ? gatherPixelsInTurn(image.data(), kGatherRows, kGatherColumns)
                                     : gatherPixels(image.data(), kGatherRows, kGatherColumns));
  }
  state.counters["items"] = static_cast<double>(kGatherRows * kGatherColumns);
}

void multiplyAdds(benchmark::State& state, int64_t target) {
  const OnlyTarget only(&state, target);
  const size_t count = 1 << 16;
  for (auto _ : state) {
    benchmark::DoNotOptimize(multiplyAdd(count));
  }
  state.counters["items"] = static_cast<double>(count * vectorLanes());
}

void readL2(benchmark::State& state, int64_t target) {
  const OnlyTarget only(&state, target);
  const size_t count = (384 * 1024) / sizeof(float), repetitions = 16;
  const auto values = hwy::AllocateAligned<float>(count);
  std::fill_n(values.get(), count, 1.0f);
  for (auto _ : state) {
    benchmark::DoNotOptimize(readFloats(values.get(), count, repetitions));
  }
  state.counters["items"] = static_cast<double>(count * repetitions);
}

/// Times a repeated computation in laps and sums the minimum processor time of each lap.
class LeastTimes {
 public:
  void start() {
    lap_ = 0;
    last_ = now_s();
  }
  void resume() { last_ = now_s(); }
  void lap() {
    const double now = now_s();
    if (lap_ == least_.size()) {
      least_.push_back(now - last_);
    }
    least_[lap_] = std::min(least_[lap_], now - last_);
    ++lap_;
    last_ = now_s();
  }
  double sum_s() const { return std::accumulate(least_.begin(), least_.end(), 0.0); }

 private:
  static double now_s() {
    timespec time;
    clock_gettime(CLOCK_THREAD_CPUTIME_ID, &time);
    return static_cast<double>(time.tv_sec) + 1e-9 * static_cast<double>(time.tv_nsec);
  }
  std::vector<double> least_;
  size_t lap_ = 0;
  double last_ = 0.0;
};

/// The first sweep: matching, aggregation and the two best peaks of every pixel.
void kernel(benchmark::State& state, int64_t target, bool fisheye) {
  const OnlyTarget only(&state, target);
  if (!only.works()) {
    return;
  }
  const Scene& s = scene(fisheye);
  const PlaneSweepOptions options = firstSweepOnly();
  const cv::Mat valid(sizes.image, CV_8UC1, cv::Scalar(255));
  const RayTable rays(s.camera, sizes.image, 6.283185307179586);
  const Hypotheses planes =
      makePlaneHypotheses(makePlaneFamilies(options, std::nullopt).front(), rays, valid);
  const SampleScale scale = SampleScale::forWindow(kMatchingWindow_px);
  // Alternates tiles with as many gathers as each tile needs and takes minimum times over several rounds:
  // laps are short enough to avoid other load, and both are measured under the same conditions.
  const std::vector<int32_t> gathered(1024 * (kGatherRows + 8), 1);
  const size_t num_hypotheses = planes.offsets.size() * s.neighbours.size();
  const std::vector<cv::Rect> tiles = makeTiles(sizes.image);
  for (auto _ : state) {
    LeastTimes times, gathers;
    for (int round = 0; round < sizes.num_rounds; ++round) {
      gathers.start();
      times.start();
      SweepInput input{s.camera,
                       &rays,
                       &valid,
                       &options,
                       sweepKernels(),
                       scale,
                       SweepReference(s.reference.pixels, options, scale),
                       {}};
      for (const SweepImage& image : s.neighbours) {
        const RigidTransform from_reference =
            image.world_from_camera.inverse() * s.reference.world_from_camera;
        input.neighbours.push_back({PackedImage(image.pixels, valid),
                                    from_reference.rotationMatrix().cast<float>(),
                                    from_reference.translation().cast<float>(), false});
      }
      TileScorer scorer;
      TileScores scores;
      times.lap();
      for (const cv::Rect& tile : tiles) {
        scorer.setTile(input, tile);
        scorer.score(planes, &scores);
        benchmark::DoNotOptimize(scores.best.data());
        times.lap();
        gathers.resume();
        const size_t pixels = static_cast<size_t>(tile.area()) * num_hypotheses;
        for (size_t i = 0; i < pixels; i += kGatherRows * kGatherColumns) {
          benchmark::DoNotOptimize(gatherPixels(gathered.data(), kGatherRows, kGatherColumns));
        }
        gathers.lap();
        times.resume();
      }
    }
    state.SetIterationTime(times.sum_s());
    state.counters["gather_s"] = gathers.sum_s();
  }
  state.counters["items"] =
      static_cast<double>(sizes.image.area()) * options.num_planes * static_cast<double>(s.neighbours.size());
}

void plain(benchmark::State& state) {
  const Scene& s = scene(true);
  PlaneSweepOptions options = firstSweepOnly();
  options.num_planes = 4;
  const cv::Mat valid(sizes.image, CV_8UC1, cv::Scalar(255));
  const auto families = makePlaneFamilies(options, std::nullopt);
  for (auto _ : state) {
    benchmark::DoNotOptimize(plainPlaneSweep(s.camera, valid, families, options, s.reference, s.neighbours,
                                             PlainBorder::kUnknown));
  }
  state.counters["items"] =
      static_cast<double>(sizes.image.area()) * options.num_planes * static_cast<double>(s.neighbours.size());
}

/// A complete range map, from images to ranges.
void rangeMap(benchmark::State& state, int ground_planes, int refinement_steps, size_t num_neighbours,
              bool coarse_pass) {
  const tbb::global_control control(tbb::global_control::max_allowed_parallelism,
                                    static_cast<size_t>(state.range(0)));
  const Scene& s = scene(true);
  PlaneSweepOptions options;
  options.num_ground_planes = ground_planes;
  options.num_refinement_steps = refinement_steps;
  options.coarse_pass = coarse_pass;
  const cv::Mat valid(sizes.image, CV_8UC1, cv::Scalar(255));
  const PlaneSweep sweep(s.camera, valid, options, s.ground);
  const std::vector<SweepImage> neighbours(
      s.neighbours.begin(), s.neighbours.begin() + static_cast<std::ptrdiff_t>(num_neighbours));
  for (auto _ : state) {
    benchmark::DoNotOptimize(sweep.sweep(s.reference, neighbours));
  }
}

/// Prints the runs as usual, keeps minimum times and prints ratios at the end.
class RatioReporter : public benchmark::ConsoleReporter {
 public:
  void ReportRuns(const std::vector<Run>& runs) override {
    benchmark::ConsoleReporter::ReportRuns(runs);
    for (const Run& run : runs) {
      if (run.error_occurred || run.run_type != Run::RT_Iteration) {
        continue;
      }
      const std::string name =
          run.run_name.function_name + (run.run_name.args.empty() ? "" : "/" + run.run_name.args);
      // Processor time for one thread, which other load affects least; otherwise wall time.
      const auto items = run.counters.find("items");
      const bool manual = run.run_name.time_type == "manual_time";
      const double per_iteration_s =
          (manual || items == run.counters.end() ? run.real_accumulated_time : run.cpu_accumulated_time) /
          static_cast<double>(run.iterations);
      const double value =
          items != run.counters.end() ? 1e9 * per_iteration_s / items->second.value : 1e3 * per_iteration_s;
      const auto gathers = run.counters.find("gather_s");
      if (gathers != run.counters.end()) {
        keep(name + "_gathers", 1e9 * gathers->second.value / items->second.value);
      }
      keep(name, value);
      keep(name + "_cpu", 1e3 * run.cpu_accumulated_time / static_cast<double>(run.iterations));
    }
  }

  /// Returns false where a figure is missing that this machine can measure.
  bool printRatios() const {
    missing_ = false;
    std::printf("\nminimum over repetitions, per pixel, plane and image:\n");
    for (const auto& [name, target] :
         {std::pair<std::string, int64_t>{"avx3", HWY_AVX3}, {"avx2", HWY_AVX2}}) {
      if ((hwy::SupportedTargets() & target) == 0) {
        continue;
      }
      print(name + ": gather limit (independent gathers), ns", get("gather/" + name), 1.0);
      print(name + ": gathers in turn, ns", get("gather/" + name + "_in_turn"), 1.0);
      print(name + ": one vector multiply-add per pixel, ns", get("multiplyAdds/" + name), 1.0);
      print(name + ": four bytes of L2, ns", get("readL2/" + name), 1.0);
      print(name + ": kernel, ns", get("kernel/" + name + "_fisheye"), 1.0);
      print(name + ": gathers between its tiles, ns", get("kernel/" + name + "_fisheye_gathers"), 1.0);
      print(name + ": kernel over gather limit", get("kernel/" + name + "_fisheye"), get("gather/" + name));
      print(name + ": kernel over gathers in turn", get("kernel/" + name + "_fisheye"),
            get("gather/" + name + "_in_turn"));
      print(name + ": kernel over gathers between its tiles", get("kernel/" + name + "_fisheye"),
            get("kernel/" + name + "_fisheye_gathers"));
      print(name + ": plain reference over kernel", get("plain"), get("kernel/" + name + "_fisheye"));
      print(name + ": fisheye over pinhole", get("kernel/" + name + "_fisheye"),
            get("kernel/" + name + "_pinhole"));
    }
    for (const char* what : {"first_sweep_of_4", "first_sweep_of_2", "whole_of_4", "whole_of_2",
                             "coarse_and_whole_of_4", "coarse_and_whole_of_2"}) {
      const std::string name = std::string("rangeMap/") + what;
      print(name + ": processor time, ms", get(name + "/1_cpu"), 1.0);
      print(name + ": one thread, ms", get(name + "/1"), 1.0);
      print(name + ": two threads, ms", get(name + "/2"), 1.0);
      print(name + ": one over two threads", get(name + "/1"), get(name + "/2"));
    }
    return !missing_;
  }

 private:
  void keep(const std::string& name, double value) {
    const auto known = least_.find(name);
    least_[name] = known == least_.end() ? value : std::min(known->second, value);
  }
  double get(const std::string& name) const {
    const auto found = least_.find(name);
    return found == least_.end() ? -1.0 : found->second;
  }
  void print(const std::string& what, double value, double of) const {
    if (value > 0.0 && of > 0.0) {
      std::printf("  %-48s %8.3f\n", what.c_str(), value / of);
    } else {
      missing_ = true;
    }
  }
  mutable bool missing_ = false;
  std::map<std::string, double> least_;
};

void byTheLaps(benchmark::internal::Benchmark* b) {
  b->Iterations(1)->UseManualTime()->Unit(benchmark::kMillisecond);
}
void onOneAndTwoThreads(benchmark::internal::Benchmark* b) {
  b->Arg(1)->Arg(2)->MeasureProcessCPUTime()->UseRealTime()->Unit(benchmark::kMillisecond);
}

BENCHMARK_CAPTURE(gather, avx3, HWY_AVX3, false);
BENCHMARK_CAPTURE(gather, avx3_in_turn, HWY_AVX3, true);
BENCHMARK_CAPTURE(gather, avx2, HWY_AVX2, false);
BENCHMARK_CAPTURE(gather, avx2_in_turn, HWY_AVX2, true);
BENCHMARK_CAPTURE(multiplyAdds, avx3, HWY_AVX3);
BENCHMARK_CAPTURE(multiplyAdds, avx2, HWY_AVX2);
BENCHMARK_CAPTURE(readL2, avx3, HWY_AVX3);
BENCHMARK_CAPTURE(readL2, avx2, HWY_AVX2);
BENCHMARK_CAPTURE(kernel, avx3_fisheye, HWY_AVX3, true)->Apply(byTheLaps);
BENCHMARK_CAPTURE(kernel, avx3_pinhole, HWY_AVX3, false)->Apply(byTheLaps);
BENCHMARK_CAPTURE(kernel, avx2_fisheye, HWY_AVX2, true)->Apply(byTheLaps);
BENCHMARK_CAPTURE(kernel, avx2_pinhole, HWY_AVX2, false)->Apply(byTheLaps);
BENCHMARK(plain)->Iterations(1)->Unit(benchmark::kMillisecond);
BENCHMARK_CAPTURE(rangeMap, first_sweep_of_4, 0, 0, 4, false)->Apply(onOneAndTwoThreads);
BENCHMARK_CAPTURE(rangeMap, first_sweep_of_2, 0, 0, 2, false)->Apply(onOneAndTwoThreads);
BENCHMARK_CAPTURE(rangeMap, whole_of_4, 16, 16, 4, false)->Apply(onOneAndTwoThreads);
BENCHMARK_CAPTURE(rangeMap, whole_of_2, 16, 16, 2, false)->Apply(onOneAndTwoThreads);
BENCHMARK_CAPTURE(rangeMap, coarse_and_whole_of_4, 16, 16, 4, true)->Apply(onOneAndTwoThreads);
BENCHMARK_CAPTURE(rangeMap, coarse_and_whole_of_2, 16, 16, 2, true)->Apply(onOneAndTwoThreads);

}  // namespace
}  // namespace vcharge

int main(int argc, char** argv) {
  std::vector<char*> arguments(argv, argv + argc);
  const auto smoke = std::find_if(arguments.begin(), arguments.end(),
                                  [](const char* a) { return std::string(a) == "--smoke"; });
  const bool is_smoke = smoke != arguments.end();
  std::string repetitions = is_smoke ? "--benchmark_repetitions=1" : "--benchmark_repetitions=5";
  std::string min_time = "--benchmark_min_time=0.001";
  if (is_smoke) {
    vcharge::sizes = {cv::Size(96, 80), 1};
    *smoke = min_time.data();
  }
  arguments.insert(arguments.begin() + 1,
                   repetitions.data());  // a user's own value comes later and overrides it
  auto count = static_cast<int>(arguments.size());
  benchmark::Initialize(&count, arguments.data());
  if (benchmark::ReportUnrecognizedArguments(count, arguments.data())) {
    return 1;
  }
  vcharge::RatioReporter reporter;
  benchmark::RunSpecifiedBenchmarks(&reporter);
  return reporter.printRatios() || !is_smoke ? 0 : 1;
}
