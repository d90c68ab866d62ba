#pragma once

#include <deque>
#include <optional>
#include <utility>
#include <vector>

#include <Eigen/Core>

#include "vcharge_core/motion/vehicle_odometry.h"
#include "vcharge_wheel_odometry/wheel_motion.h"

namespace vcharge {

/// Dead reckoning with its covariance.
struct OdometryEstimate {
  VehicleOdometry odometry;
  Eigen::Matrix3d pose_covariance = Eigen::Matrix3d::Zero();  ///< x, y (metres), yaw (radians), in odom
  double speed_variance = 0.0;                                ///< m^2/s^2
  double yaw_rate_variance = 0.0;                             ///< rad^2/s^2
};

struct WheelOdometryCounts {
  uint64_t measurements = 0;
  uint64_t slips = 0;
  uint64_t out_of_order = 0;
  uint64_t gaps = 0;    ///< longer than WheelMotion::kMaxGap_s
  uint64_t resets = 0;  ///< counters that jumped, or long gaps in speeds
  bool slipping = false;
  bool standing = false;
};

/// Causal dead reckoning at the centre of the rear axle from the counters or speeds of the rear wheels and
/// the steering angle. A counter is exact within one tick, so a Kalman filter uses the counters as bounded
/// positions of the wheels instead of noisy increments: only errors of the wheel radius and the track width
/// grow. Cars compute wheel speeds from such counters, so the integral of the speeds is used in the same way,
/// with its own resolution. In between, speed and steering predict the pose (bicycle model with an estimated
/// zero of the steering), which keeps it smooth. A slipping rear wheel is ignored until all wheels agree
/// again: with speeds of the front wheels, it slips if it contradicts the front wheel on its side, which then
/// replaces it; otherwise, if the wheels contradict the steering angle. During a gap in the speeds, motion is
/// interpolated and its uncertainty grows; after a long one, the pose goes on where it was. Counters lose
/// nothing. Not thread safe.
class WheelOdometry {
 public:
  explicit WheelOdometry(const WheelOdometryOptions& options);
  /// The estimate at the measurement's stamp; the first is the identity. nullopt for a measurement that is
  /// not newer than the last. All must be of one kind, with finite speeds of the rear wheels.
  std::optional<OdometryEstimate> add(const WheelMeasurement& wheels);
  const WheelOdometryCounts& counts() const { return counts_; }

 private:
  struct Sample {
    Timestamp stamp;
    double left_m, right_m;  // measured distances
    double front_left_m, front_right_m;
    double steered_yaw_rad;  // integral of the steered yaw rate
    double speed_m_per_s;    // estimated speed
  };
  struct Steering {
    bool is_known = false;
    double curvature_per_m = 0.0;
    double sigma_per_m = 0.0;
  };
  /// Curvature of the path by the steering angle now and before its lag.
  Steering steeringOf(const WheelMeasurement& wheels);
  void predict(double dt_s, const Steering& steering);
  void addMotion(const WheelMotion& motion);
  void addGap(double gap_s);
  void checkSlip(const Sample& sample, bool has_front_wheels, bool is_steered);
  void correct(const WheelMotion& motion, const Steering& steering);
  void takeBack(double left_excess_m, double right_excess_m, double speed_before_m_per_s);
  void forgetSpeeds();
  OdometryEstimate estimate(Timestamp stamp, double distance_m, double turn_rad);

  WheelOdometryOptions options_;
  WheelOdometryCounts counts_;
  std::optional<WheelMeasurement> last_;
  double left_m_ = 0.0, right_m_ = 0.0;  // measured since the beginning
  double front_left_m_ = 0.0, front_right_m_ = 0.0;
  double left_excess_m_ = 0.0, right_excess_m_ = 0.0;  // the part caused by slip
  double steered_yaw_rad_ = 0.0;
  Timestamp last_motion_;
  std::deque<Sample> window_;
  std::deque<std::pair<Timestamp, double>> steering_;  // curvatures by the angles of the last lag
  bool left_slips_ = false, right_slips_ = false;
  Eigen::Vector2d along_ = Eigen::Vector2d::Zero();  // state: distance, speed
  Eigen::Matrix2d along_covariance_;
  Eigen::Vector3d turn_ = Eigen::Vector3d::Zero();  // state: yaw, yaw rate, curvature at steering's zero
  Eigen::Matrix3d turn_covariance_;
  RigidTransform odom_from_vehicle_;
  double yaw_rad_ = 0.0;
  Eigen::Matrix3d pose_covariance_ = Eigen::Matrix3d::Zero();
};

/// Sorts estimates by stamp for publishing, with one at the stamp of each camera trigger. Estimates of ticks
/// wait for the next trigger, at most `hold_s`. The estimate at a trigger is extrapolated if the ticks are
/// late; once they reach it, it is published again under the same stamp, corrected. Not thread safe.
class OdometryStream {
 public:
  OdometryStream(double hold_s, double max_extrapolation_s);
  /// For triggers at this rate.
  static OdometryStream forFrameRate(double frame_rate_hz);

  /// Returns the estimates to publish now, in order of stamps.
  std::vector<OdometryEstimate> add(const OdometryEstimate& estimate);
  /// Like add(). The last estimate is at `stamp`, interpolated or extrapolated by up to max_extrapolation_s;
  /// it is missing if neither is possible, or if later ones were published already.
  std::vector<OdometryEstimate> trigger(Timestamp stamp);
  /// The estimates that wait, at the end of a drive or when the odometry starts again at another pose. Stamps
  /// after it still increase.
  std::vector<OdometryEstimate> flush();

 private:
  std::optional<OdometryEstimate> at(Timestamp stamp) const;
  void release(Timestamp before, std::vector<OdometryEstimate>* ready);

  Duration hold_, max_extrapolation_;
  std::deque<OdometryEstimate> history_;  // the newest second
  std::optional<Timestamp> published_;
  std::optional<Timestamp> extrapolated_;  // trigger whose estimate is to be corrected
};

}  // namespace vcharge
