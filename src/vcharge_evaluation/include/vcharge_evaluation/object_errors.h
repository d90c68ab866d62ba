#pragma once

#include <functional>
#include <map>
#include <optional>
#include <set>
#include <vector>

#include "vcharge_core/base/options.h"
#include "vcharge_core/motion/tracked_object.h"
#include "vcharge_evaluation/error_distribution.h"
#include "vcharge_evaluation/obstacle_truth.h"
#include "vcharge_evaluation/outlines.h"

namespace vcharge {

/// Options of ObjectEvaluator. The outline of the vehicle is that of the simulated car.
struct ObjectEvaluationOptions {
  VCHARGE_BEGIN_OPTIONS(ObjectEvaluationOptions);
  VCHARGE_OPTION(double, max_distance_m, 8.0, positive(),
                 "Largest distance between the outlines of the vehicle and a judged object.");
  VCHARGE_OPTION(double, min_speed_m_per_s, 0.15, notNegative(), "Least speed of an object that is due.");
  VCHARGE_OPTION(double, min_visible_fraction, 30.0 / (640 * 400), positive(),
                 "Least part of the pixels of one camera that show a visible object: 30 of 640x400.");
  VCHARGE_OPTION(double, gate_m, 1.0, positive(),
                 "Largest position error of a report of an object, and the error of a missed one.");
  VCHARGE_END_OPTIONS();
};

/// All movers of a simulated drive at one image, in the world frame, whether visible or not.
struct TrueObjectFrame {
  Timestamp stamp;
  RigidTransform world_from_vehicle;
  std::vector<TrackedObject> objects;
  std::vector<double> visible_fraction;  ///< of each object: part of the pixels of the camera that shows most
};

/// Number of visible points on each object: inside its footprint grown by 5 cm, more than 5 cm above its base
/// and less than 5 cm above its top. The ground around an object and a ceiling above it do not show it.
std::vector<size_t> countPointsOn(const std::vector<TrackedObject>& objects,
                                  const std::vector<SeenPoint>& points);

/// Errors over the images in which an object was due. A missed one counts with the gate and with 1 m/s.
struct ObjectFigures {
  size_t num_due = 0, num_found = 0;
  size_t num_good_position = 0, num_good_velocity = 0, num_good = 0;  ///< good: both
  size_t num_right_class = 0;
  ErrorDistribution position_error_m;  ///< of the point nearest to the vehicle
  ErrorDistribution centre_error_m;
  ErrorDistribution velocity_error_m_per_s;
};

/// A run of images, of at least 1 s, in which one true object was due.
struct Crossing {
  uint32_t object = 0;
  ObjectClass object_class = ObjectClass::kUnknown;
  Timestamp from, to;
  size_t num_due = 0, num_found = 0;
  std::set<uint32_t> ids;  ///< of the reports
  /// Whether at least half of the images have a report, and all reports one id.
  bool kept() const { return 2 * num_found >= num_due && ids.size() == 1; }
};

/// A true object that came nearer than 1.5 m to the vehicle, which stood, after it had been farther than 2 m
/// and in sight for at least 0.5 s.
struct ObjectApproach {
  uint32_t object = 0;
  ObjectClass object_class = ObjectClass::kUnknown;
  Timestamp stamp;                ///< first image in which it is that near
  bool reported = false;          ///< in an earlier image, of the last 0.5 s
  double first_reported_m = 0.0;  ///< distance of the first report since it came into sight; 0 without one
};

/// How soon a true object that was ever due was found.
struct FirstObjectReport {
  uint32_t object = 0;
  ObjectClass object_class = ObjectClass::kUnknown;
  bool found = false;
  double delay_s = 0.0;  ///< since it first moved visibly near the vehicle; never found: the whole drive
};

/// A report of a moving object that was near the vehicle and farther than 1 m from every mover, in at least
/// three images.
struct FalseObject {
  uint32_t id = 0;
  size_t num_frames = 0;
  Timestamp first;
};

struct ObjectErrors {
  size_t num_frames = 0;
  double duration_s = 0.0;
  ObjectFigures all;
  std::map<ObjectClass, ObjectFigures> by_class;  ///< of the true object; those that were due
  struct DistanceBin {
    double from_m = 0.0, to_m = 0.0;
    ObjectFigures figures;
  };
  std::vector<DistanceBin> by_distance;
  std::vector<Crossing> crossings;
  std::vector<ObjectApproach> approaches;
  std::vector<FirstObjectReport> first_reports;
  std::vector<FalseObject> false_objects;
  /// Squares of the centres' errors by the reported covariances; means of 2 are honest. At most
  /// kMaxNormalizedError each, which counts also where a covariance is not positive definite.
  ErrorDistribution normalized_error;
  size_t num_normalized_within_95 = 0;
  std::optional<Timestamp> worst;  ///< image with the largest sum of errors; absent if nothing was due

  double false_per_minute() const;
};

inline constexpr double kMaxNormalizedError = 1000.0;

/// Judges reports of moving objects. True and reported objects are compared in the vehicle's frame, without
/// height, roll and pitch: the true ones through the true pose, reports through their odometry.
///
/// A true object is due in an image if it moves (it is not standing, and its mean speed over the last 0.5 s
/// is large enough), and has been near and visible for at least 0.5 s without interruption. Reports are
/// assigned to all true objects one to one, such that the sum of position errors, with the gate for each
/// object without a report, is least. The position error is the distance of the points of the two outlines
/// that are nearest to that point of the vehicle's outline which is nearest to the true object: one point for
/// both, so that the error has no jump where an outline lies along the vehicle's.
class ObjectEvaluator {
 public:
  explicit ObjectEvaluator(const ObjectEvaluationOptions& options = {});
  ~ObjectEvaluator();

  /// Images in order of time. `reported` has the same stamp; where nothing was reported it has no objects.
  void add(const TrueObjectFrame& truth, const ObjectFrame& reported);

  ObjectErrors errors() const;

 private:
  struct Body;
  struct Sample;
  struct Track;

  Body bodyOf(const TrackedObject& object, const RigidTransform& vehicle_from_frame) const;
  std::vector<const Body*> assign(const std::vector<Body>& movers, const std::vector<Body>& reports) const;
  Eigen::Vector2d nearestToVehicle(const Body& body, const Body& mover) const;
  void judgeMover(const Body& mover, const Body* report, Track* track);
  bool vehicleStands(const RigidTransform& world_from_vehicle);
  void judgeApproach(const Body& mover, bool is_reported, Track* track);
  void countFalse(const std::vector<Body>& reports, const std::vector<Body>& movers);
  ObjectFigures figuresOf(const std::function<bool(const Sample&)>& isChosen) const;

  const ObjectEvaluationOptions options_;
  const Outline vehicle_;
  std::vector<Timestamp> stamps_;
  std::map<uint32_t, Track> tracks_;
  std::vector<Sample> samples_;
  std::vector<Crossing> crossings_;
  std::vector<ObjectApproach> approaches_;
  std::optional<Eigen::Vector2d> vehicle_m_;  // in the world, where it has stood since stands_since_
  Timestamp stands_since_;
  std::map<uint32_t, FalseObject> unmatched_;
};

}  // namespace vcharge
