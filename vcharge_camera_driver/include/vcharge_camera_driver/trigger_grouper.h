#pragma once

#include <deque>
#include <memory>
#include <optional>
#include <utility>
#include <vector>

#include "vcharge_camera_driver/frame_source.h"
#include "vcharge_core/frames/multi_frame_synchronizer.h"

namespace vcharge {

struct TriggerGrouperOptions {
  double frame_rate_hz = 12.5;  ///< of the trigger
  /// After its start, and whenever its frame numbers and stamps disagree, a camera must bring so many frames
  /// in which they agree before its images are used: a frame that comes late, with the stamp of the next
  /// pulse, is recognized by it when the camera catches up within so many frames.
  int realign_frames = 5;

  template <class Visitor>
  void visitFields(Visitor&& visit) {
    visit("frame_rate_hz", frame_rate_hz);
    visit("realign_frames", realign_frames);
  }
  void validate() const;  ///< throws std::invalid_argument naming the field
};

/// What became of a camera's frames.
struct TriggerCameraCounts {
  bool aligned = false;
  uint64_t frames = 0;
  uint64_t lost = 0;       ///< by number, while aligned
  uint64_t slips = 0;      ///< numbers and stamps disagreed
  uint64_t unaligned = 0;  ///< frames not used since
  uint64_t missing = 0;    ///< groups without this camera
};

struct TriggerGrouperCounts {
  uint64_t complete = 0;
  uint64_t incomplete = 0;
  uint64_t late = 0;          ///< frames whose group was gone
  double max_spread_s = 0.0;  ///< between the stamps of one group
  double mean_spread_s = 0.0;
  std::vector<TriggerCameraCounts> cameras;
};

/// Groups the frames of cameras that one trigger fires. A frame's number and its stamp must tell the same
/// story: so many pulses since the camera's last frame. Where they do, frames whose stamps lie within half a
/// period are of one pulse. Groups come out in order of time, complete ones at once, those that lack a camera
/// half a period after their first frame came. Their stamp is the earliest of their frames. Not thread safe.
class TriggerGrouper {
 public:
  using Groups = std::vector<std::shared_ptr<const MultiFrame>>;

  TriggerGrouper(size_t num_cameras, const TriggerGrouperOptions& options);

  /// Takes one frame at time `now` (of any clock that does not jump); returns the groups that are ready by
  /// it.
  Groups add(const CapturedFrame& frame, Timestamp now);
  /// The groups whose time is over at `now`.
  Groups expire(Timestamp now);
  /// When expire() has work to do next.
  std::optional<Timestamp> nextDeadline() const;

  TriggerGrouperCounts counts() const;

 private:
  struct Camera {
    std::optional<uint32_t> sequence;
    Timestamp stamp;
    int consistent = 0;
    TriggerCameraCounts counts;
  };
  /// True when the frame may be grouped.
  bool align(const CapturedFrame& frame);
  void collect(Groups groups, Groups* ready);

  const TriggerGrouperOptions options_;
  const Duration period_, tolerance_;
  MultiFrameSynchronizer synchronizer_;
  std::vector<Camera> cameras_;
  std::deque<std::pair<Timestamp, Timestamp>> arrivals_;  // now, stamp
  std::deque<std::pair<Timestamp, Timestamp>> spans_;     // recent stamps: earliest, latest of a pulse
  uint64_t num_spreads_ = 0;
  double sum_spread_s_ = 0.0;
  double max_spread_s_ = 0.0;
};

}  // namespace vcharge
