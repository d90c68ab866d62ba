#include "landmarks/track_observations.h"

#include <algorithm>
#include <tuple>

namespace vcharge {

void sortObservations(Track* track) {
  std::vector<TrackObservation>& observations = track->observations;
  const auto key = [](const TrackObservation& o) {
    return std::make_tuple(o.keyframe, o.camera, o.sigma_px, o.feature < 0, o.feature);
  };
  std::sort(observations.begin(), observations.end(),
            [&](const TrackObservation& a, const TrackObservation& b) { return key(a) < key(b); });
  observations.erase(std::unique(observations.begin(), observations.end(),
                                 [](const TrackObservation& a, const TrackObservation& b) {
                                   return a.keyframe == b.keyframe && a.camera == b.camera;
                                 }),
                     observations.end());
}

}  // namespace vcharge
