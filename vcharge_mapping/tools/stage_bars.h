#pragma once

#include <memory>
#include <string>

#include "vcharge_core/base/progress_bar.h"

namespace vcharge {

/// Shows one progress bar per stage.
class StageBars {
 public:
  void show(const std::string& stage, int number, int num_stages, double fraction) {
    if (stage != shown_) {
      bar_.reset();
      bar_ = std::make_unique<ProgressBar>(std::to_string(number) + "/" + std::to_string(num_stages) + " " +
                                           stage);
      shown_ = stage;
    }
    bar_->update(fraction);
  }
  void end() {
    bar_.reset();
    shown_.clear();
  }

 private:
  std::unique_ptr<ProgressBar> bar_;
  std::string shown_;
};

}  // namespace vcharge
