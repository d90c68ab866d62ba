#pragma once

#include <cstdint>
#include <optional>
#include <vector>

#include "vcharge_core/frames/frame_assembler.h"
#include "vcharge_reconstruction/map_localizer.h"

namespace vcharge {

/// Where a lost vehicle may be. Places of the map that fit the images are followed by odometry and images
/// over the frames, until one remains that two frames confirm. Places that look alike are kept as long as
/// none has clearly more inliers than the others.
class PlaceHypotheses {
 public:
  /// What a frame tells.
  struct Result {
    PoseFix fix;         ///< of the best place; kAmbiguous if there are others; without a pose if none fits
    int num_places = 0;  ///< that remain
    bool is_confirmed = false;
  };

  /// `localizer` must outlive this. `max_ambiguity`: inliers of a place over those of the best one, above
  /// which it remains.
  PlaceHypotheses(const MapLocalizer& localizer, double max_ambiguity)
      : localizer_(localizer), max_ambiguity_(max_ambiguity) {}

  /// Follows the places to this frame, and searches the whole map where none of them fits.
  Result update(const ImageFrame& frame, const RigFeatures& features);

  bool isEmpty() const { return places_.empty(); }
  void clear() { places_.clear(); }

 private:
  struct Place {
    RigidTransform map_from_vehicle;
    PoseFix fix;               ///< the last one
    double sum_inliers = 0.0;  ///< of fixes, with less weight the older they are
    double sum_weights = 0.0;
    int num_frames = 0;  ///< that gave a fix
    int num_missed = 0;  ///< frames without one since the last

    void addFix(const PoseFix& found);
    void addMiss();
    double inliers() const { return sum_inliers / sum_weights; }
  };
  /// The frame to which the places belong.
  struct LastFrame {
    Timestamp stamp;
    std::optional<RigidTransform> odom_from_vehicle;
    int64_t num_resets;
  };
  void moveTo(const ImageFrame& frame);
  void follow(const RigFeatures& features);
  /// Adds the places of the whole map that fit; returns the best fix, which may be none.
  PoseFix search(const RigFeatures& features);
  void dropBeaten();

  const MapLocalizer& localizer_;
  const double max_ambiguity_;
  std::vector<Place> places_;  // best first
  std::optional<LastFrame> last_;
  int frames_until_search_ = 0;
};

}  // namespace vcharge
