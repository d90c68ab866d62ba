#pragma once

#include <cstddef>

namespace vcharge {

/// Whether the ground mirrors, as it does in the wet: of what is seen on it while the vehicle drives, a part
/// can only be reflections. On dry ground few things look so by chance.
class MirrorEvidence {
 public:
  /// `least_part`: of what was seen lately, for the ground to mirror.
  explicit MirrorEvidence(double least_part) : least_part_(least_part) {}

  /// Counts points or pixels of the ground in an image, and those of them that look like reflections.
  void add(size_t seen, size_t reflections) {
    seen_ += static_cast<double>(seen);
    reflections_ += static_cast<double>(reflections);
  }
  /// Ends an image of all cameras: what was counted becomes less important than what follows.
  void endImage();
  bool isMirror() const;

 private:
  double least_part_;
  double seen_ = 0.0, reflections_ = 0.0;
};

}  // namespace vcharge
