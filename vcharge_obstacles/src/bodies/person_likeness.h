#pragma once

#include <optional>

#include <opencv2/core.hpp>

#include "bodies/body_match.h"
#include "bodies/people_classifier.h"
#include "points/panorama.h"

namespace vcharge {

/// The part of a view that looks most like a person.
struct PersonMatch {
  double score = 0.0;      ///< signed distance from the border between people and all else, about -3 to 3
  double shift_rad = 0.0;  ///< azimuth beyond the expected one
};

/// Tells how much the view at a place on the ground looks like a person who stands or walks there, see
/// PeopleClassifier. It tells nothing about motion. Deterministic; immutable.
class PersonLikeness {
 public:
  /// Searches adults and children about the expected place, whose range may be wrong by a fifth. None too
  /// near to the camera and at the rim of the panorama. The camera is `camera_height_m` above the ground.
  std::optional<PersonMatch> find(const Panorama& panorama, const cv::Mat& now, const BodyBearing& expected,
                                  double camera_height_m) const;

 private:
  const PeopleClassifier classifier_;
};

}  // namespace vcharge
