#include "vcharge_reconstruction/reconstruction_steps.h"

#include <memory>

namespace vcharge {

void findAndCloseLoops(const ReconstructionOptions& options, const LoopProgress& progress,
                       ReconstructionState* state) {
  const std::shared_ptr<const VocabularyTree> vocabulary = trainVocabulary(state->data);
  state->report.loop_edges = findLoops(options.loops, vocabulary, state->data, progress);
  closeLoops(&state->report.loop_edges, &state->data);
  triangulateTracks(options.triangulation, &state->data);
}

void recordAdjustment(const BundleAdjustmentSummary& summary, ReconstructionReport* report) {
  report->num_observations = summary.num_observations;
  report->rms_px = summary.rms_px;
}

}  // namespace vcharge
