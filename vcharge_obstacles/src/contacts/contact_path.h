#pragma once

#include <optional>
#include <utility>
#include <vector>

#include <Eigen/Core>

#include "vcharge_core/base/timestamp.h"

namespace vcharge {

/// The positions of one object's contacts with the ground over the last second. Their scatter about a
/// straight motion tells their error, which differs with the ground, the light and the distance: no error is
/// assumed.
class ContactPath {
 public:
  void add(Timestamp stamp, const Eigen::Vector2d& position_m) { positions_.emplace_back(stamp, position_m); }
  /// Drops what is too old at a stamp.
  void forgetBefore(Timestamp stamp);
  /// Velocity of the straight motion, if the contacts fit it better than standing still, surely (F test with
  /// two parameters), and have moved further than they scatter by themselves.
  std::optional<Eigen::Vector2d> velocity() const;

 private:
  std::vector<std::pair<Timestamp, Eigen::Vector2d>> positions_;
};

}  // namespace vcharge
