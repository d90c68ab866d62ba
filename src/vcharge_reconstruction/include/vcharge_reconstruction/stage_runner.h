#pragma once

#include "vcharge_core/base/stage_timer.h"
#include "vcharge_reconstruction/sparse_mapper_report.h"
#include "vcharge_reconstruction/stage_progress.h"

namespace vcharge {

/// Runs the stages of a reconstruction one after the other: tells of their progress and takes their time.
class StageRunner {
 public:
  /// All must outlive this.
  StageRunner(int num_stages, const StageCallback& progress, SparseMapperReport* report)
      : num_stages_(num_stages), progress_(progress), report_(report) {}

  template <class Work>
  void run(const char* name, const Work& work) {
    ++number_;
    tell(name, 0.0);
    {
      const StageTimer timer(name, &report_->stage_s);
      work();
    }
    tell(name, 1.0);
  }

  /// How far the stage that runs has got.
  void tell(const char* name, double fraction) const { progress_({name, number_, num_stages_, fraction}); }

 private:
  const int num_stages_;
  const StageCallback& progress_;
  SparseMapperReport* const report_;
  int number_ = 0;
};

}  // namespace vcharge
