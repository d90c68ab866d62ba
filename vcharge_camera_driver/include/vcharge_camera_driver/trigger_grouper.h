#pragma once

#include <deque>
#include <memory>
#include <optional>
#include <vector>

#include "vcharge_camera_driver/frame_source.h"
#include "vcharge_core/base/options.h"
#include "vcharge_core/frames/multi_frame_synchronizer.h"

namespace vcharge {

struct TriggerGrouperOptions {
  VCHARGE_BEGIN_OPTIONS(TriggerGrouperOptions);
  VCHARGE_OPTION(double, frame_rate_hz, 12.5, above(0.0).upTo(1000.0), "Rate of the trigger.");
  VCHARGE_OPTION(
      int, realign_frames, 5, atLeast(1),
      "Consistent frames of a camera before its images are used, after a start or a disagreement.");
  VCHARGE_END_OPTIONS();
};

/// Statistics of a camera's frames.
struct TriggerCameraCounts {
  bool aligned = false;
  uint64_t frames = 0;
  uint64_t lost = 0;       ///< frames lost according to sequence numbers, while aligned
  uint64_t slips = 0;      ///< disagreements between sequence numbers and stamps
  uint64_t unaligned = 0;  ///< frames that were not used after a slip
  uint64_t missing = 0;    ///< groups without this camera
};

struct TriggerGrouperCounts {
  uint64_t complete = 0;
  uint64_t incomplete = 0;
  uint64_t late = 0;          ///< frames that arrived after their group was complete or expired
  double max_spread_s = 0.0;  ///< maximum difference between the stamps of one group
  double mean_spread_s = 0.0;
  std::vector<TriggerCameraCounts> cameras;
};

/// Groups the frames of cameras with a common trigger. The sequence number and the stamp of a frame must
/// agree on the number of pulses since the camera's previous frame. If they do, frames whose stamps differ by
/// less than half a period belong to the same pulse. Groups are returned in the order of time: complete ones
/// at once, others half a period after their first frame. The stamp of a group is the earliest of its frames.
/// Not thread safe.
class TriggerGrouper {
 public:
  using Groups = std::vector<std::shared_ptr<const MultiFrame>>;

  TriggerGrouper(size_t num_cameras, const TriggerGrouperOptions& options);

  /// Adds a frame at time `now` (of any steady clock); returns the groups that became ready.
  Groups add(const CapturedFrame& frame, Timestamp now);
  /// Returns the groups whose time has expired at `now`.
  Groups expire(Timestamp now);
  /// Time of the next call to expire(), if any.
  std::optional<Timestamp> nextDeadline() const;

  TriggerGrouperCounts counts() const;

 private:
  struct Camera {
    std::optional<uint32_t> sequence;
    Timestamp stamp;
    int consistent = 0;
    TriggerCameraCounts counts;
  };
  struct Arrival {
    Timestamp time, stamp;
  };
  struct StampSpan {
    Timestamp earliest, latest;
  };
  /// Counts the frame; returns true if the camera's numbers and stamps have agreed for long enough.
  bool align(const CapturedFrame& frame);
  /// Appends groups to `ready` and counts the images that they lack.
  void takeGroups(Groups groups, Groups* ready);

  const TriggerGrouperOptions options_;
  const Duration tolerance_;  // half a period
  MultiFrameSynchronizer synchronizer_;
  std::vector<Camera> cameras_;
  std::deque<Arrival> arrivals_;  // frames of groups that are not complete
  std::deque<StampSpan> spans_;   // one per recent pulse
  uint64_t num_spreads_ = 0;
  double sum_spread_s_ = 0.0;
  double max_spread_s_ = 0.0;
};

}  // namespace vcharge
