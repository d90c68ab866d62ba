// Times of writing and reading the map of a long drive (200,000 landmarks, 1.5 million observations), and of
// two parts of reading: the copy into a SparseMap and the content hash.

#include <filesystem>
#include <string>

#include <benchmark/benchmark.h>

#include "vcharge_core/sparse_map/analytic_map.h"
#include "vcharge_core/sparse_map/sparse_map_file.h"

namespace vcharge {
namespace {

const SparseMap& largeMap() {
  static const SparseMap kMap = [] {
    AnalyticMapOptions options;
    options.num_keyframes = 3000;
    options.num_landmarks = 294000;
    options.num_neighbours = 3;
    options.descriptor_size = 64;
    return SparseMap(makeAnalyticMap(options));
  }();
  return kMap;
}

std::string mapPath() {
  return (std::filesystem::temp_directory_path() / "sparse_map_file_benchmark.vmap").string();
}

void describe(benchmark::State* state) {
  state->counters["landmarks"] = static_cast<double>(largeMap().landmarks().size());
  state->counters["observations"] = static_cast<double>(largeMap().observations().size());
}

void writeMap(benchmark::State& state) {
  for (auto _ : state) {
    writeSparseMap(largeMap(), {}, mapPath());
  }
  describe(&state);
  state.counters["file_MiB"] = static_cast<double>(std::filesystem::file_size(mapPath())) / (1 << 20);
}
BENCHMARK(writeMap)->Unit(benchmark::kMillisecond);

void readMap(benchmark::State& state) {
  for (auto _ : state) {
    benchmark::DoNotOptimize(readSparseMap(mapPath()));
  }
  describe(&state);
}
BENCHMARK(readMap)->Unit(benchmark::kMillisecond);

void copyIntoSparseMap(benchmark::State& state) {
  for (auto _ : state) {
    benchmark::DoNotOptimize(SparseMap(largeMap().contents()));
  }
}
BENCHMARK(copyIntoSparseMap)->Unit(benchmark::kMillisecond);

void hashContent(benchmark::State& state) {
  for (auto _ : state) {
    benchmark::DoNotOptimize(largeMap().contentHash());
  }
}
BENCHMARK(hashContent)->Unit(benchmark::kMillisecond);

}  // namespace
}  // namespace vcharge

int main(int argc, char** argv) {
  benchmark::Initialize(&argc, argv);
  benchmark::RunSpecifiedBenchmarks();
  std::filesystem::remove(vcharge::mapPath());
  return 0;
}
