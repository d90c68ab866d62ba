#pragma once

#include <cstdint>
#include <vector>

#include <Eigen/Core>

#include "contacts/contact_path.h"
#include "objects/object_detections.h"
#include "vcharge_core/base/timestamp.h"
#include "vcharge_core/motion/rigid_transform.h"
#include "vcharge_core/motion/tracked_object.h"

namespace vcharge {

/// Follows objects over time and cameras: a Kalman filter per object with constant velocity in the fixed
/// frame, one-to-one assignment by Mahalanobis distance, and an existence probability from hits and misses.
/// Deterministic.
class ObjectFilter {
 public:
  /// Moves all objects to a stamp. Stamps must not decrease.
  void predict(Timestamp stamp);
  /// Adds the detections of one camera at that stamp.
  void update(const std::vector<ObjectDetection>& detections, const RigidTransform& fixed_from_vehicle);
  /// An object as it is expected at this stamp, in the fixed frame.
  struct Expected {
    size_t index = 0;  ///< until finish()
    Eigen::Vector2d position_m, velocity_m_per_s;
    double width_m = 0.0, height_m = 0.0;
    bool is_detected = false;  ///< by a camera, at this stamp
    Timestamp last_look;       ///< see addLook(); zero without one
  };
  /// Objects that are probable enough to be searched in the images.
  std::vector<Expected> expected() const;
  /// Corrects an object by a measured number: its difference from the expected one, its derivative by
  /// position and velocity, and its standard deviation. False, and not used, if it contradicts what is
  /// expected.
  bool correct(size_t index, double innovation, const Eigen::Vector4d& row, double sigma);
  /// Adds log-odds to the existence of an object that no camera detects at this stamp.
  void vote(size_t index, double log_odds) { tracks_[index].votes += log_odds; }
  /// Adds how much an object looks like a person in each view, PersonMatch::score, and the log-odds by which
  /// it is more probable at this stamp and until the next look.
  void addLook(size_t index, const std::vector<double>& scores, double log_odds);
  /// Ends the stamp: objects that no camera has detected become less probable, and some end.
  void finish();
  /// Objects that probably exist, in the fixed frame. Their covariances contain the errors that successive
  /// measurements have in common, as seen from the nearest of the cameras, if their poses are given.
  std::vector<TrackedObject> objects(const std::vector<RigidTransform>& fixed_from_cameras = {}) const;
  void clear();

 private:
  static constexpr double kUnlike = -1.5;  // median likeness to a person of what is none
  struct Track {
    uint32_t id = 0;
    Eigen::Vector4d state = Eigen::Vector4d::Zero();  // x, y, velocity along x and y
    Eigen::Matrix4d covariance = Eigen::Matrix4d::Identity();
    double existence_log_odds = 0.0;
    double height_m = 0.0, width_m = 0.0;  // as seen lately
    Timestamp last_seen;
    Eigen::Vector2d start_m = Eigen::Vector2d::Zero();  // as first detected
    Eigen::Matrix2d start_covariance = Eigen::Matrix2d::Identity();
    bool has_moved = false;
    int num_detections = 0;  // with a velocity
    ContactPath contacts;    // of detections without one
    double drift_m_per_s = 0.0;
    Timestamp last_moving;  // detected, or surely moving
    double votes = 0.0;     // at this stamp
    double likeness = kUnlike;
    Timestamp last_look;
    double look_vote = 0.0;
  };
  bool walks(const Track& track) const;
  static bool movesLikePerson(const Track& track, double speed_sigmas);
  void note(const ObjectDetection& detection, const Eigen::Vector2d& position_m, Track* track) const;
  static TrackedObject describe(const Track& track, const Eigen::Matrix4d& covariance);
  void mergeTwins();

  std::vector<Track> tracks_;
  Timestamp stamp_;
  uint32_t next_id_ = 1;
};

}  // namespace vcharge
