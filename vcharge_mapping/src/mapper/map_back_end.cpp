#include "vcharge_mapping/map_back_end.h"

#include <cmath>

#include "vcharge_core/base/error.h"
#include "vcharge_core/base/stage_timer.h"
#include "vcharge_reconstruction/map_assembly.h"

namespace vcharge {
namespace {

using Fraction = std::function<void(double)>;

void adjust(const BundleAdjustmentOptions& options, MappingState* state) {
  const BundleAdjustmentSummary summary = adjustBundle(options, &state->data);
  state->report.num_observations = summary.num_observations;
  state->report.rms_px = summary.rms_px;
}

void adjustFirst(const SparseMapperOptions& options, const Fraction& /*progress*/, MappingState* state) {
  // Chained motions bend: rays may miss their point by much more than they will in the end.
  TriangulationOptions lenient = options.triangulation;
  lenient.max_error_rad = options.first_max_error_rad;
  BundleAdjustmentOptions lenient_bundle = options.bundle;
  lenient_bundle.outlier_sigmas = INFINITY;
  triangulateTracks(lenient, &state->data);
  adjust(lenient_bundle, state);
  triangulateTracks(options.triangulation, &state->data);
  adjust(options.bundle, state);
}

void train(const SparseMapperOptions& options, const Fraction& /*progress*/, MappingState* state) {
  state->vocabulary = trainVocabulary(options.loops, state->data);
}

void findAllLoops(const SparseMapperOptions& options, const Fraction& progress, MappingState* state) {
  state->report.loop_edges = findLoops(options.loops, state->vocabulary, state->data, progress);
}

void closeAllLoops(const SparseMapperOptions& options, const Fraction& /*progress*/, MappingState* state) {
  closeLoops(options.loops, &state->report.loop_edges, &state->data);
  triangulateTracks(options.triangulation, &state->data);
}

void search(const SparseMapperOptions& options, const Fraction& /*progress*/, MappingState* state) {
  searchLandmarks(options.search, &state->data);
}

void adjustAgain(const SparseMapperOptions& options, const Fraction& /*progress*/, MappingState* state) {
  adjust(options.bundle, state);
}

void adjustLast(const SparseMapperOptions& options, const Fraction& /*progress*/, MappingState* state) {
  adjust(options.bundle, state);
  checkLoops(options.loops, state->data, &state->report.loop_edges);
}

struct Stage {
  const char* name;
  void (*work)(const SparseMapperOptions&, const Fraction&, MappingState*);
};

constexpr Stage kStages[] = {
    {"first adjustment", adjustFirst},  {"vocabulary", train},           {"loops", findAllLoops},
    {"pose graph", closeAllLoops},      {"landmark search", search},     {"adjustment", adjustAgain},
    {"second landmark search", search}, {"last adjustment", adjustLast},
};
constexpr int kNumStages = sizeof(kStages) / sizeof(kStages[0]);
constexpr char kAssembly[] = "assembly";

}  // namespace

const std::vector<std::string>& backEndStages() {
  static const std::vector<std::string> names = [] {
    std::vector<std::string> result;
    for (const Stage& stage : kStages) {
      result.emplace_back(stage.name);
    }
    return result;
  }();
  return names;
}

std::shared_ptr<const SparseMap> runBackEnd(const SparseMapperOptions& options, const StageCallback& progress,
                                            const CheckpointCallback& checkpoint, MappingState* state) {
  const auto tell = [&](const char* stage, int index, double fraction) {
    progress({stage, index + 1, kNumStages + 1, fraction});
  };
  while (state->num_finished_stages < kNumStages) {
    const int index = state->num_finished_stages;
    const Stage& stage = kStages[index];
    tell(stage.name, index, 0.0);
    {
      const StageTimer timer(stage.name, &state->report.stage_s);
      stage.work(
          options, [&](double fraction) { tell(stage.name, index, fraction); }, state);
    }
    tell(stage.name, index, 1.0);
    ++state->num_finished_stages;
    if (checkpoint) {
      const StageTimer timer("checkpoints", &state->report.stage_s);
      checkpoint(stage.name, *state);
    }
  }
  state->report.num_landmarks = 0;
  for (const Track& track : state->data.tracks) {
    state->report.num_landmarks += track.position_m ? 1 : 0;
  }
  if (state->report.num_landmarks == 0) {
    throw InputError("no map could be made: no point of the scene was seen from enough places");
  }
  tell(kAssembly, kNumStages, 0.0);
  std::shared_ptr<const SparseMap> map;
  {
    const StageTimer timer(kAssembly, &state->report.stage_s);
    map = assembleMap(state->data, state->report.loop_edges, options.features, *state->vocabulary);
  }
  tell(kAssembly, kNumStages, 1.0);
  return map;
}

}  // namespace vcharge
