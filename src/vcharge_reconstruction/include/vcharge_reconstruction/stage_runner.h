#pragma once

#include <functional>
#include <string>
#include <utility>

#include "vcharge_core/base/stage_timer.h"
#include "vcharge_reconstruction/reconstruction_report.h"

namespace vcharge {

/// Progress of a reconstruction.
struct StageProgress {
  std::string stage;
  int number = 1;  ///< number of the stage, from 1
  int num_stages = 1;
  double fraction = 0.0;  ///< completed fraction of the stage
};
using StageCallback = std::function<void(const StageProgress&)>;

/// Runs the stages of a reconstruction one after the other, reports progress and measures their times.
class StageRunner {
 public:
  /// `report` must outlive this object. The callback may be empty, and may throw to end the work.
  StageRunner(int num_stages, StageCallback progress, ReconstructionReport* report)
      : num_stages_(num_stages), progress_(std::move(progress)), report_(report) {}

  template <class Work>
  void run(const char* name, const Work& work) {
    ++number_;
    report_->stages.emplace_back(name);
    tell(name, 0.0);
    {
      const StageTimer timer(name, &report_->stage_s);
      work();
    }
    tell(name, 1.0);
  }

  /// Reports the progress inside the current stage.
  void tell(const char* name, double fraction) const {
    if (progress_) {
      progress_({name, number_, num_stages_, fraction});
    }
  }

 private:
  const int num_stages_;
  const StageCallback progress_;
  ReconstructionReport* const report_;
  int number_ = 0;
};

}  // namespace vcharge
