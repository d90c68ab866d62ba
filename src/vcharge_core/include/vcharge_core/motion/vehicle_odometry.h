#pragma once

#include <cstdint>
#include <deque>
#include <limits>
#include <optional>
#include <string>
#include <variant>
#include <vector>

#include "vcharge_core/base/options.h"
#include "vcharge_core/base/timestamp.h"
#include "vcharge_core/motion/rigid_transform.h"
#include "vcharge_core/motion/vehicle_rates.h"

namespace vcharge {

/// Dead-reckoned state of the vehicle at one instant. The vehicle frame (base_link) lies on the ground under
/// the centre of the rear axle: x forward, y left, z up. Odometry from wheels alone is planar (z, roll and
/// pitch zero); sources that know all six degrees of freedom may fill them in.
struct VehicleOdometry {
  Timestamp stamp;
  RigidTransform odom_from_vehicle;
  double forward_speed_m_per_s = 0.0;
  double yaw_rate_rad_per_s = 0.0;

  VehicleRates rates() const { return {forward_speed_m_per_s, yaw_rate_rad_per_s}; }
};

/// Fills the velocities of poses by central differences, one-sided at the ends.
void fillVelocities(std::vector<VehicleOdometry>* poses);

/// Raw counters of the rear wheels.
struct WheelTicks {
  Timestamp stamp;
  int64_t left_ticks = 0;
  int64_t right_ticks = 0;
  double metres_per_tick = 0.01;
  /// Angle of a virtual front wheel in the middle, positive to the left; NaN where the car does not tell.
  double steering_angle_rad = 0.0;
};

/// Speeds of the wheels' circumferences, negative backwards. NaN where the car does not tell.
struct WheelSpeeds {
  static constexpr double kUnknown = std::numeric_limits<double>::quiet_NaN();
  Timestamp stamp;
  double rear_left_m_per_s = 0.0;
  double rear_right_m_per_s = 0.0;
  double front_left_m_per_s = kUnknown;
  double front_right_m_per_s = kUnknown;
  double steering_angle_rad = kUnknown;  ///< as in WheelTicks
};

/// What a car tells of its wheels.
using WheelMeasurement = std::variant<WheelTicks, WheelSpeeds>;

inline Timestamp stampOf(const WheelMeasurement& wheels) {
  return std::visit([](const auto& each) { return each.stamp; }, wheels);
}

struct OdometryBufferOptions {
  VCHARGE_BEGIN_OPTIONS(OdometryBufferOptions);
  VCHARGE_OPTION(double, max_gap_s, 0.25, positive(),
                 "Longest interval between entries that is interpolated.");
  VCHARGE_OPTION(double, history_s, 60.0, positive(),
                 "Age at which entries are dropped; infinity keeps all.");
  VCHARGE_END_OPTIONS();
};

/// Interpolates odometry between its stamps. An entry with the stamp of an earlier one replaces it, as when
/// an extrapolated pose becomes known. Does not extrapolate: lookups outside the buffer or inside a gap
/// return a status. Not thread safe.
class OdometryBuffer {
 public:
  enum class AddResult {
    kAdded,
    kAddedAfterGap,  ///< added, more than max_gap_s after the previous entry
    kCorrected,      ///< same stamp as an earlier entry, which it replaces
    kOutOfOrder,     ///< slightly older than the newest entry: ignored
    kReset,          ///< time jumped backwards: all older entries were dropped, this one was kept
  };
  enum class LookupStatus { kOk, kEmpty, kBeforeFirst, kAfterLast, kInGap };
  struct Lookup {
    LookupStatus status = LookupStatus::kEmpty;
    VehicleOdometry odometry;  ///< valid only when status is kOk
    explicit operator bool() const { return status == LookupStatus::kOk; }
  };
  struct Counts {
    uint64_t added = 0;
    uint64_t gaps = 0;
    uint64_t corrections = 0;
    uint64_t out_of_order = 0;
    uint64_t resets = 0;
  };

  explicit OdometryBuffer(const OdometryBufferOptions& options = OdometryBufferOptions());

  AddResult add(const VehicleOdometry& odometry);
  /// Interpolated pose and velocities at `stamp`.
  Lookup lookup(Timestamp stamp) const;

  bool empty() const { return entries_.empty(); }
  std::optional<Timestamp> newestStamp() const;
  const Counts& counts() const { return counts_; }

 private:
  OdometryBufferOptions options_;
  std::deque<VehicleOdometry> entries_;  // strictly increasing stamps
  Counts counts_;
};

/// The status in words, for example "before the first odometry", to end a sentence in a message.
std::string describe(OdometryBuffer::LookupStatus status);

}  // namespace vcharge
