#pragma once

#include <cstdint>
#include <deque>
#include <memory>
#include <optional>
#include <vector>

#include "vcharge_core/base/options.h"
#include "vcharge_core/frames/image.h"

namespace vcharge {

struct MultiFrameSynchronizerOptions {
  VCHARGE_BEGIN_OPTIONS(MultiFrameSynchronizerOptions);
  VCHARGE_OPTION(double, tolerance_s, 0.0, between(0.0, 3600.0), "Difference of stamps of one instant.");
  VCHARGE_OPTION(bool, keep_incomplete, false, anyValue(), "Whether takeIncomplete() returns sets.");
  VCHARGE_END_OPTIONS();
};

/// Counts of the sets and images so far.
struct MultiFrameSynchronizerCounts {
  uint64_t complete_sets = 0;
  uint64_t incomplete_sets = 0;              ///< sets given up with at least one camera missing
  uint64_t late_images = 0;                  ///< images that arrived after their set was complete or given up
  uint64_t duplicate_images = 0;             ///< images with the camera and stamp of an earlier one
  uint64_t resets = 0;                       ///< jumps back of the time
  std::vector<uint64_t> missing_per_camera;  ///< incomplete sets that lacked this camera
};

/// Groups images whose stamps differ slightly, as from cameras with a common trigger, into sets (the
/// camera driver gives them one stamp; FrameAssembler puts images of equal stamps together with odometry).
/// Sets are returned in order of time as soon as they are complete; incomplete sets older than a complete one
/// are given up and counted. The stamp of a set is the earliest of its images. Not thread safe.
class MultiFrameSynchronizer {
 public:
  explicit MultiFrameSynchronizer(
      size_t num_cameras, const MultiFrameSynchronizerOptions& options = MultiFrameSynchronizerOptions());

  /// Takes one image; returns the set that it completes, or null. std::logic_error for a bad camera index.
  std::shared_ptr<const MultiFrame> add(size_t camera_index, Timestamp stamp, const Image& image);

  /// Gives up the pending sets up to `stamp`.
  void giveUpUntil(Timestamp stamp);
  /// The sets given up since the last call, in order of time; missing images have no pixels. Empty unless
  /// keep_incomplete is set. They are older than the next set of add(), also if that call gave them up.
  std::vector<std::shared_ptr<const MultiFrame>> takeIncomplete();

  const MultiFrameSynchronizerCounts& counts() const { return counts_; }

 private:
  struct PendingSet {
    MultiFrame frame;  // its stamp is that of the earliest image
    Timestamp latest;
    std::vector<bool> present;
    size_t num_present = 0;
  };
  void giveUpOldest();

  const size_t num_cameras_;
  const MultiFrameSynchronizerOptions options_;
  const Duration tolerance_;
  std::deque<PendingSet> pending_;  // in order of stamp
  std::optional<Timestamp> last_closed_;
  std::optional<Timestamp> newest_;
  std::vector<std::shared_ptr<const MultiFrame>> incomplete_;
  MultiFrameSynchronizerCounts counts_;
};

}  // namespace vcharge
