#pragma once

#include <cstdint>
#include <functional>
#include <vector>

#include "vcharge_core/base/timestamp.h"
#include "vcharge_core/motion/rigid_transform.h"
#include "vcharge_simulation/scenes/ground_height.h"
#include "vcharge_simulation/vehicle/drive_path.h"

namespace vcharge {

/// How the car drives along a path and how its body moves on its springs. Set by the drives of the catalogue.
struct VehicleMotionOptions {
  double cruise_speed_m_per_s = 2.5;
  double standstill_s = 0.0;  ///< time at rest at the start; 0: the drive starts at cruise speed
  bool stop_at_end = false;
  double duration_s = 60.0;     ///< upper limit of the duration
  double start_height_m = 0.0;  ///< selects the level of the ground where there are several
  double track_width_m = 1.52;  ///< distance between the rear wheels
  double wheelbase_m = 2.58;
  double pitch_rad_per_m_per_s2 = 0.0045;  ///< nose up when accelerating
  double road_noise_rad = 0.0012;          ///< standard deviation of pitch and roll caused by the road
  double road_heave_m = 0.002;             ///< standard deviation of the height caused by the road
  /// Nose up, by a load that lowers the body over the rear axle; null: no load.
  std::function<double(Duration since_start)> load_pitch_rad;
};

/// State of the vehicle at one instant.
struct MotionSample {
  RigidTransform world_from_planar;  ///< pose of the rear axle, projected to z = 0
  RigidTransform planar_from_body;  ///< height, pitch and roll of the ground and of the suspension, about the
                                    ///< vehicle origin
  double speed_m_per_s = 0.0;       ///< speed along the ground, negative when driving backwards
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
