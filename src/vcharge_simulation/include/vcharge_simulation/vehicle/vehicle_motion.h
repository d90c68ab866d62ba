#pragma once

#include <cstdint>
#include <vector>

#include "vcharge_core/motion/rigid_transform.h"
#include "vcharge_simulation/scenes/ground_height.h"
#include "vcharge_simulation/vehicle/drive_path.h"

namespace vcharge {

/// How the car drives along a path and how its body moves on its springs.
struct VehicleMotionOptions {
  double cruise_speed_m_per_s = 2.5;
  double max_backwards_speed_m_per_s = 1.2;
  double max_lateral_acceleration_m_per_s2 = 1.2;
  double max_acceleration_m_per_s2 = 1.0;
  double standstill_s = 0.0;  ///< at the start; 0: the drive starts at cruise speed
  bool stop_at_end = false;
  double track_width_m = 1.52;  ///< between the rear wheels
  double wheelbase_m = 2.58;
  double pitch_rad_per_m_per_s2 = 0.0045;  ///< nose up when accelerating
  double roll_rad_per_m_per_s2 = 0.006;    ///< to the outside of a curve
  double spring_frequency_hz = 1.6;
  double road_noise_rad = 0.0012;  ///< standard deviation of pitch and roll from the road
  double road_heave_m = 0.002;
  double duration_s = 60.0;  ///< at most

  template <class Visitor>
  void visitFields(Visitor&& visit) {
    visit("cruise_speed_m_per_s", cruise_speed_m_per_s);
    visit("max_backwards_speed_m_per_s", max_backwards_speed_m_per_s);
    visit("max_lateral_acceleration_m_per_s2", max_lateral_acceleration_m_per_s2);
    visit("max_acceleration_m_per_s2", max_acceleration_m_per_s2);
    visit("standstill_s", standstill_s);
    visit("stop_at_end", stop_at_end);
    visit("track_width_m", track_width_m);
    visit("wheelbase_m", wheelbase_m);
    visit("pitch_rad_per_m_per_s2", pitch_rad_per_m_per_s2);
    visit("roll_rad_per_m_per_s2", roll_rad_per_m_per_s2);
    visit("spring_frequency_hz", spring_frequency_hz);
    visit("road_noise_rad", road_noise_rad);
    visit("road_heave_m", road_heave_m);
    visit("duration_s", duration_s);
  }
  void validate() const;  ///< throws std::invalid_argument naming the field
};

/// State of the vehicle at one instant.
struct MotionSample {
  RigidTransform world_from_planar;  ///< pose of the rear axle, projected to z = 0
  RigidTransform planar_from_body;  ///< height, pitch and roll of the ground and of the suspension, about the
                                    ///< vehicle origin
  double speed_m_per_s = 0.0;       ///< along the ground, negative when driving backwards
  double curvature_per_m = 0.0;
  double left_wheel_m = 0.0;  ///< distance rolled by the rear wheels
  double right_wheel_m = 0.0;

  RigidTransform worldFromVehicle() const { return world_from_planar * planar_from_body; }
};

/// Motion along a path in steps of one millisecond, each an exact circular arc of the bicycle model as seen
/// from above. On uneven ground the four wheel contacts set height, pitch and roll, and the wheels roll along
/// the ground's surface. Covers kMargin_s before time 0 and after duration(), so that filters can use samples
/// on both sides.
class VehicleMotion {
 public:
  static constexpr int kStepsPerSecond = 1000;
  static constexpr double kMargin_s = 0.5;

  /// A null `ground_height` means level ground at z = 0.
  VehicleMotion(const DrivePath& path, const VehicleMotionOptions& options, uint64_t seed,
                const GroundHeight& ground_height = nullptr);

  /// Time of the end of the path, at most options.duration_s.
  double duration() const { return duration_s_; }
  /// Number of samples before time 0.
  static int marginSteps() { return static_cast<int>(kMargin_s * kStepsPerSecond); }
  const std::vector<MotionSample>& samples() const { return samples_; }
  /// State at a whole millisecond in [-margin, duration + margin].
  const MotionSample& at(int milliseconds) const {
    return samples_.at(static_cast<size_t>(milliseconds + marginSteps()));
  }
  const VehicleMotionOptions& options() const { return options_; }

 private:
  VehicleMotionOptions options_;
  std::vector<MotionSample> samples_;
  double duration_s_ = 0.0;
};

}  // namespace vcharge
