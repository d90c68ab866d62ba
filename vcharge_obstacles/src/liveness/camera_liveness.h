#pragma once

#include <cstdint>
#include <deque>
#include <functional>
#include <optional>

#include "vcharge_core/base/timestamp.h"
#include "vcharge_core/motion/rigid_transform.h"

namespace vcharge {

/// Drive time after its last new image from which a camera counts as silent.
inline constexpr double kSilent_s = 0.3;

/// Follows whether one camera delivers new images. A standing car gets no range maps, but it gets images. An
/// image that repeats the one before while the vehicle moves is not new: the camera is frozen.
///
/// Before the first image nothing is known, and the camera does not count as silent. The result depends on
/// stamps only, not on the order in which images, range maps and odometry arrive.
class CameraLiveness {
 public:
  using PoseAt = std::function<std::optional<RigidTransform>(Timestamp)>;
  enum class State { kUnknown, kAlive, kSilent, kFrozen };

  /// Adds an image by a fingerprint of its pixels; those not newer than the last one are ignored.
  void addImage(Timestamp stamp, uint64_t fingerprint);
  /// Judges the images up to a stamp that the odometry has reached.
  void settle(Timestamp until, const PoseAt& fixed_from_vehicle_at);
  /// A range map proves that there was an image; not if that image is known to repeat the one before.
  void addRangeMap(Timestamp stamp);
  /// The poses have jumped.
  void noteJump() { last_new_pose_.reset(); }

  State stateAt(Timestamp stamp) const;
  /// Whether the camera counted as silent or frozen at some time in (from, to].
  bool wasSilent(Timestamp from, Timestamp to) const;
  /// Whether it delivered all the time in (from, to]; before the first image, whether range maps come.
  bool isAlive(Timestamp from, Timestamp to) const;
  /// Whether the image at a stamp repeats the one before.
  bool isRepeated(Timestamp stamp) const;
  /// Stamp of the last new image.
  const std::optional<Timestamp>& lastNew() const { return last_new_; }

 private:
  struct Image {
    Timestamp stamp;
    uint64_t fingerprint;
  };
  struct Judged {
    Timestamp stamp;
    bool is_repeated;
  };
  /// Time between two new images that are more than kSilent_s apart.
  struct Gap {
    Timestamp from, to;
  };

  void noteNew(Timestamp stamp);

  std::deque<Image> waiting_;
  std::deque<Judged> judged_;
  std::deque<Gap> gaps_;
  std::optional<uint64_t> last_fingerprint_;
  std::optional<RigidTransform> last_new_pose_;  // at the last image that differed
  std::optional<Timestamp> last_new_, last_range_map_;
};

}  // namespace vcharge
