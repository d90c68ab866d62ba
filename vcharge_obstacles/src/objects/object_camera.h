#pragma once

#include <deque>
#include <utility>
#include <vector>

#include <Eigen/Core>
#include <opencv2/core.hpp>

#include "bodies/body_stereo.h"
#include "contacts/ground_contact.h"
#include "light/mirror_evidence.h"
#include "objects/freestanding.h"
#include "objects/object_detections.h"
#include "objects/object_filter.h"
#include "objects/pose_history.h"
#include "points/followed_points.h"
#include "points/panorama.h"
#include "points/rotation_correction.h"
#include "points/static_motion.h"
#include "vcharge_core/camera/camera_rig.h"
#include "vcharge_core/camera/working_camera.h"
#include "vcharge_obstacles/object_tracker.h"

namespace vcharge {

/// A followed point that is old enough to be judged, and its equation for the body's rotation.
struct JudgedPoint {
  const PointTrack* track;
  RigidTransform before_from_now;  // motion of the vehicle
  double age_s;
  StaticResidual found;
  RotationEquation equation;
};

/// One camera of ObjectTracker: its followed points, the ground in its images, and its view of the objects.
class ObjectCamera {
 public:
  /// Less travel within the history of the points is none.
  static constexpr double kStandstill_m = 0.05;

  ObjectCamera(const RigCamera& camera, const ObjectTrackerOptions& options);

  /// Adds the image at the newest of the poses.
  void add(const cv::Mat& sensor_image, const PoseHistory& poses);
  void clear();
  /// The points that can be judged.
  std::vector<JudgedPoint> judge(const PoseHistory& poses, MirrorEvidence* mirror) const;
  /// Those of them that nothing static explains, if the body has turned by this from the odometry.
  std::vector<MovingPoint> movingPoints(const std::vector<JudgedPoint>& judged,
                                        const Eigen::Vector3d& rotation) const;
  /// Compares the ground with that of the oldest image that was taken near enough; false without an earlier
  /// image.
  bool compareGround(const PoseHistory& poses, bool is_mirror);
  /// Finds the objects that are expected in the image.
  void follow(const PoseHistory& poses, bool is_compared, bool is_at_rest, ObjectFilter* filter) const;
  CameraMotion motion(const PoseHistory& poses) const;

  const GroundContact& contact() const { return contact_; }
  const RigidTransform& vehicleFromCamera() const { return vehicle_from_camera_; }
  /// The image as a panorama.
  PanoramaView view() const { return {panorama_, now_.image, vehicle_from_camera_.translation()}; }

 private:
  struct Rendered {
    Timestamp stamp;
    cv::Mat image;  // empty without one
  };
  RigidTransform groundMotion(Timestamp before, const RigidTransform& before_from_now) const;
  bool hasKeptAppearance(const PointTrack& track) const;

  const RigidTransform vehicle_from_camera_;
  const WorkingCamera working_;
  const double focal_px_;   // in the middle of the image, per radian
  const double sigma_rad_;  // of the motion of a point between two images
  FollowedPoints points_;
  GroundContact contact_;
  const Panorama panorama_;
  Rendered before_, now_;  // panoramas
  std::deque<std::pair<Timestamp, cv::Mat>> images_;
};

}  // namespace vcharge
