#pragma once

namespace vcharge {

/// Whether the ground mirrors, as it does in the wet, told from followed points below the horizon while the
/// vehicle drives: a reflection moves as something static that is deeper than the ground, which nothing on
/// dry ground does. Of the points seen lately, few movers do by chance.
class MirrorEvidence {
 public:
  /// Counts a point below the horizon with parallax; whether only something static below the ground explains
  /// it.
  void add(bool is_below_ground) {
    points_ += 1.0;
    below_ground_ += is_below_ground ? 1.0 : 0.0;
  }
  /// Ends an image of all cameras: what was counted becomes less important than what follows.
  void endImage();
  bool isMirror() const;

 private:
  double points_ = 0.0, below_ground_ = 0.0;
};

}  // namespace vcharge
