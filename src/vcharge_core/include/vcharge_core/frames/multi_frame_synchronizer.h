#pragma once

#include <cstdint>
#include <deque>
#include <functional>
#include <memory>
#include <optional>
#include <vector>

#include "vcharge_core/frames/image.h"

namespace vcharge {

struct MultiFrameSynchronizerOptions {
  double tolerance_s = 0.0;        ///< images this close belong together; 0: equal stamps (hardware sync)
  int max_pending_sets = 8;        ///< incomplete sets kept before the oldest is given up
  double reset_backwards_s = 1.0;  ///< a stamp this far before the newest starts over (a replayed bag)
  bool keep_incomplete = false;    ///< sets that were given up wait in takeIncomplete()

  template <class Visitor>
  void visitFields(Visitor&& visit) {
    visit("tolerance_s", tolerance_s);
    visit("max_pending_sets", max_pending_sets);
    visit("reset_backwards_s", reset_backwards_s);
    visit("keep_incomplete", keep_incomplete);
  }
  void validate() const;  ///< throws std::invalid_argument naming the field
};

/// What became of the images so far.
struct MultiFrameSynchronizerCounts {
  uint64_t complete_sets = 0;
  uint64_t incomplete_sets = 0;              ///< given up with at least one camera missing
  uint64_t late_images = 0;                  ///< arrived after their set was complete, given up or overtaken
  uint64_t duplicate_images = 0;             ///< same camera and stamp again
  uint64_t resets = 0;                       ///< time jumped back
  std::vector<uint64_t> missing_per_camera;  ///< incomplete sets that lacked this camera
};

/// Groups single images into MultiFrames. Emits sets in time order, each as soon as it is complete; a set
/// that a complete later one overtakes is given up and counted. The set's stamp is the earliest of its
/// images. Not thread safe.
class MultiFrameSynchronizer {
 public:
  explicit MultiFrameSynchronizer(
      size_t num_cameras, const MultiFrameSynchronizerOptions& options = MultiFrameSynchronizerOptions());

  /// Takes one image; returns the set that it completes, or null. std::logic_error for a bad camera index.
  std::shared_ptr<const MultiFrame> add(size_t camera_index, Timestamp stamp, const Image& image);

  /// Gives up the pending sets whose stamp is not after `stamp`: what they lack is not waited for any more.
  void giveUpUntil(Timestamp stamp);
  /// The sets given up since the last call, in order of time; images that are missing have no pixels. Empty
  /// unless keep_incomplete is set. They are older than what add() returns next, also when it gave them up.
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
