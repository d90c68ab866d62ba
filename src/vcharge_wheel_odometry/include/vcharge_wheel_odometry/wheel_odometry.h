#pragma once

#include <deque>
#include <optional>
#include <utility>
#include <vector>

#include <Eigen/Core>

#include "vcharge_core/base/options.h"
#include "vcharge_core/motion/vehicle_odometry.h"

namespace vcharge {

struct WheelOdometryOptions {
  VCHARGE_BEGIN_OPTIONS(WheelOdometryOptions);
  VCHARGE_OPTION(double, track_width_m, 1.52, positive(), "Distance between the rear wheels.");
  VCHARGE_OPTION(double, wheelbase_m, 2.58, positive(), "Distance between the axles.");
  VCHARGE_OPTION(bool, use_steering, true, anyValue(), "Whether the car measures the steering angle.");
  VCHARGE_OPTION(double, steering_lag_s, 0.05, between(0.0, 0.5), "Age of the steering angle at its stamp.");
  VCHARGE_OPTION(double, max_acceleration_m_per_s2, 1.5, positive(), "Noise of the speed in a second.");
  VCHARGE_OPTION(double, max_yaw_acceleration_rad_per_s2, 0.4, positive(), "The same of the yaw rate.");
  VCHARGE_OPTION(double, steering_noise_per_m, 0.002, positive(), "Sigma of the steered curvature.");
  VCHARGE_OPTION(double, slip_yaw_rad, 0.04, positive(), "Larger disagreement with the steering is a slip.");
  VCHARGE_OPTION(double, distance_error_ratio, 0.005, positive(), "Relative error of the wheel radius.");
  VCHARGE_OPTION(double, yaw_error_rad_per_m, 0.0005, positive(), "Heading error of unequal wheels.");
  VCHARGE_END_OPTIONS();
};

/// Dead reckoning with its covariance.
struct OdometryEstimate {
  VehicleOdometry odometry;
  Eigen::Matrix3d pose_covariance = Eigen::Matrix3d::Zero();  ///< x, y (metres), yaw (radians), in odom
  double speed_variance = 0.0;                                ///< m^2/s^2
  double yaw_rate_variance = 0.0;                             ///< rad^2/s^2
};

struct WheelOdometryCounts {
  uint64_t ticks = 0;
  uint64_t slips = 0;
  uint64_t out_of_order = 0;
  uint64_t gaps = 0;    ///< gaps longer than kMaxGap_s
  uint64_t resets = 0;  ///< counters that jumped
  bool slipping = false;
  bool standing = false;
};

/// Causal dead reckoning at the centre of the rear axle from the counters of the rear wheels and the steering
/// angle. A counter is exact within one tick, so a Kalman filter uses the counters as bounded positions of
/// the wheels instead of noisy increments: only errors of the wheel radius and the track width grow. Between
/// ticks speed and steering predict the pose (bicycle model with an estimated zero of the steering), which
/// keeps it smooth. If the wheels contradict the steering angle, one of them slips and is ignored until both
/// agree again. Not thread safe.
class WheelOdometry {
 public:
  static constexpr double kMaxGap_s = 0.5;

  explicit WheelOdometry(const WheelOdometryOptions& options);
  /// The estimate at the ticks' stamp; the first is the identity. nullopt for ticks that are not newer than
  /// the last.
  std::optional<OdometryEstimate> add(const WheelTicks& ticks);
  const WheelOdometryCounts& counts() const { return counts_; }

 private:
  struct Sample {
    Timestamp stamp;
    double left_m, right_m;  // counted distances
    double steered_yaw_rad;  // integral of the steered yaw rate
    double speed_m_per_s;    // estimated speed
  };
  /// Curvature of the path by the steering angle now and before its lag, and its standard deviation.
  std::pair<double, double> steeredCurvature(const WheelTicks& ticks);
  void predict(double dt_s, double steered_curvature);
  void checkSlip(const Sample& sample);
  void correct(double dt_s, double tick_m, double steered_curvature, double steered_sigma);
  void stand();
  OdometryEstimate estimate(Timestamp stamp, double distance_m, double turn_rad);

  WheelOdometryOptions options_;
  WheelOdometryCounts counts_;
  std::optional<WheelTicks> last_;
  double left_m_ = 0.0, right_m_ = 0.0;                // counted since the first ticks
  double left_excess_m_ = 0.0, right_excess_m_ = 0.0;  // the part caused by slip
  double steered_yaw_rad_ = 0.0;
  Timestamp last_motion_;
  std::deque<Sample> window_;
  std::deque<std::pair<Timestamp, double>> steering_;  // curvatures by the angles of the last lag
  bool left_slips_ = false;
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
