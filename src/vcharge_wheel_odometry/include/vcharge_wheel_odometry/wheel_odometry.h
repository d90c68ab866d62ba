#pragma once

#include <deque>
#include <optional>
#include <vector>

#include <Eigen/Core>

#include "vcharge_core/base/options.h"
#include "vcharge_core/motion/vehicle_odometry.h"

namespace vcharge {

struct WheelOdometryOptions {
  double track_width_m = 1.52;  ///< between the rear wheels
  double wheelbase_m = 2.58;
  bool use_steering = true;                      ///< false: the car tells no steering angle
  double max_acceleration_m_per_s2 = 1.5;        ///< usual change of the speed, per root of a second
  double max_yaw_acceleration_rad_per_s2 = 0.4;  ///< the same of the yaw rate, where no steering tells it
  double steering_noise_per_m = 0.002;           ///< standard deviation of the curvature that steering tells
  double slip_window_s = 0.5;                    ///< over which wheels and steering are compared
  double slip_yaw_rad = 0.04;                    ///< a difference above this, and above
  double slip_share = 0.25;                      ///< this share of the turn, is a slip
  double distance_error_share = 0.005;           ///< wrong wheel radius, for the covariance
  double yaw_error_rad_per_m = 0.0005;           ///< unequal wheels, for the covariance
  double standstill_s = 0.3;                     ///< without a tick

  template <class Visitor>
  void visitFields(Visitor&& visit) {
    visit("track_width_m", track_width_m);
    visit("wheelbase_m", wheelbase_m);
    visit("use_steering", use_steering);
    visit("max_acceleration_m_per_s2", max_acceleration_m_per_s2);
    visit("max_yaw_acceleration_rad_per_s2", max_yaw_acceleration_rad_per_s2);
    visit("steering_noise_per_m", steering_noise_per_m);
    visit("slip_window_s", slip_window_s);
    visit("slip_yaw_rad", slip_yaw_rad);
    visit("slip_share", slip_share);
    visit("distance_error_share", distance_error_share);
    visit("yaw_error_rad_per_m", yaw_error_rad_per_m);
    visit("standstill_s", standstill_s);
  }
  void validate() const;  ///< throws std::invalid_argument naming the field
};

/// Dead reckoning with what it is worth.
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
  uint64_t gaps = 0;    ///< of more than kMaxGap_s
  uint64_t resets = 0;  ///< counters that jumped
  bool slipping = false;
  bool standing = false;
};

/// Causal dead reckoning at the centre of the rear axle from the counters of the rear wheels and the steering
/// angle. A count is right within a tick, and stays so: a Kalman filter takes the counters as bounded
/// positions of the wheels, not their noisy increments, so that no error but that of wheels and track grows.
/// Between ticks speed and steering carry the pose (bicycle model; the steering's zero is estimated), hence
/// it is smooth. Where the wheels turn otherwise than the steering says, one of them slips: it is not
/// believed until both agree again. Not thread safe.
class WheelOdometry {
 public:
  static constexpr double kMaxGap_s = 0.5;

  explicit WheelOdometry(const WheelOdometryOptions& options);
  /// The estimate at the ticks' stamp; the first is the identity. Nothing for ticks that are not newer than
  /// the last.
  std::optional<OdometryEstimate> add(const WheelTicks& ticks);
  const WheelOdometryCounts& counts() const { return counts_; }

 private:
  struct Sample {
    Timestamp stamp;
    double left_m, right_m;  // as counted
    double steered_yaw_rad;  // integral of what the steering says
    double speed_m_per_s;    // estimated then
  };
  void predict(double dt_s, double steered_curvature);
  void checkSlip(const Sample& sample);
  void correct(double dt_s, double tick_m, double steered_curvature);
  void stand();
  OdometryEstimate estimate(Timestamp stamp, double distance_m, double turn_rad);

  const WheelOdometryOptions options_;
  WheelOdometryCounts counts_;
  std::optional<WheelTicks> last_;
  double left_m_ = 0.0, right_m_ = 0.0;                // counted since the first ticks
  double left_excess_m_ = 0.0, right_excess_m_ = 0.0;  // of it, by slip
  double steered_yaw_rad_ = 0.0;
  Timestamp last_motion_;
  std::deque<Sample> window_;
  bool left_slips_ = false;
  Eigen::Vector2d along_ = Eigen::Vector2d::Zero();  // distance, speed
  Eigen::Matrix2d along_covariance_;
  Eigen::Vector3d turn_ = Eigen::Vector3d::Zero();  // yaw, yaw rate, curvature at steering's zero
  Eigen::Matrix3d turn_covariance_;
  RigidTransform odom_from_vehicle_;
  double yaw_rad_ = 0.0;
  Eigen::Matrix3d pose_covariance_ = Eigen::Matrix3d::Zero();
};

/// Puts estimates into the order of stamps in which they are published: each trigger has one at its very
/// stamp. Estimates of ticks wait for the next trigger, but not longer than `hold_s`. Not thread safe.
class OdometryStream {
 public:
  OdometryStream(double hold_s, double max_extrapolation_s);

  /// Returns what is to be published now, in order of stamps.
  std::vector<OdometryEstimate> add(const OdometryEstimate& estimate);
  /// As add(); the last is that at `stamp`, interpolated, or extrapolated by max_extrapolation_s at most.
  /// Without it where that cannot be had, or where later ones are published already.
  std::vector<OdometryEstimate> trigger(Timestamp stamp);

 private:
  std::optional<OdometryEstimate> at(Timestamp stamp) const;
  void release(Timestamp before, std::vector<OdometryEstimate>* ready);

  const Duration hold_, max_extrapolation_;
  std::deque<OdometryEstimate> history_;  // the newest second
  std::optional<Timestamp> published_;
};

}  // namespace vcharge
