#pragma once

#include <functional>
#include <string>

namespace vcharge {

/// How far a reconstruction has got.
struct StageProgress {
  std::string stage;
  int number = 1;  ///< of the stage, from 1
  int num_stages = 1;
  double fraction = 0.0;  ///< of the stage
};
using StageCallback = std::function<void(const StageProgress&)>;

}  // namespace vcharge
