#include "vcharge_simulation/vehicle/vehicle_motion.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <optional>

#include "vcharge_core/base/error.h"
#include "vcharge_core/motion/vehicle_rates.h"
#include "vcharge_simulation/rendering/noise.h"

namespace vcharge {

namespace {

constexpr double kTwoPi = 6.28318530717958647692;
constexpr double kStep_s = 1.0 / VehicleMotion::kStepsPerSecond;
constexpr double kSpeedTimeConstant_s = 0.6;
constexpr double kBraking_m_per_s2 = 0.8;
constexpr double kMaxAcceleration_m_per_s2 = 1.0;
constexpr double kMaxLateralAcceleration_m_per_s2 = 1.2;
constexpr double kMaxBackwardsSpeed_m_per_s = 1.2;
constexpr double kSpringFrequency_hz = 1.6;
constexpr double kRoll_rad_per_m_per_s2 = 0.006;  // roll per lateral acceleration, to the outside of a curve
constexpr double kLookAhead_m = 1.5;

// Road roughness: a sum of sines over the distance driven, with standard deviation one. The car shakes only
// while it moves.
class RoadNoise {
 public:
  explicit RoadNoise(Random* random) {
    for (Wave& wave : waves_) {
      wave.wavelength_m = 0.9 * std::pow(10.0, random->uniform());
      wave.phase_rad = random->uniform(0.0, kTwoPi);
    }
  }
  double at(double s_m) const {
    double sum = 0.0;
    for (const Wave& wave : waves_) {
      sum += std::sin(kTwoPi * s_m / wave.wavelength_m + wave.phase_rad);
    }
    return sum * std::sqrt(2.0 / static_cast<double>(waves_.size()));
  }

 private:
  struct Wave {
    double wavelength_m, phase_rad;
  };
  std::array<Wave, 6> waves_;
};

// Critically damped second-order filter.
class Spring {
 public:
  double update(double target) {
    const double acceleration = kOmega * kOmega * (target - value_) - 2.0 * kOmega * rate_;
    rate_ += acceleration * kStep_s;
    value_ += rate_ * kStep_s;
    return value_;
  }

 private:
  static constexpr double kOmega = kTwoPi * kSpringFrequency_hz;
  double value_ = 0.0, rate_ = 0.0;
};

// Ground heights under the four wheels.
class WheelContacts {
 public:
  WheelContacts(const GroundHeight& ground_height, const VehicleMotionOptions& options,
                const RigidTransform& world_from_planar, double near_z_m)
      : track_m_(options.track_width_m), wheelbase_m_(options.wheelbase_m) {
    const auto height = [&](double x_m, double y_m) {
      const Eigen::Vector3d position_m = world_from_planar * Eigen::Vector3d(x_m, y_m, 0.0);
      return ground_height(position_m.x(), position_m.y(), near_z_m);
    };
    rear_left_m = height(0.0, 0.5 * track_m_);
    rear_right_m = height(0.0, -0.5 * track_m_);
    front_left_m_ = height(wheelbase_m_, 0.5 * track_m_);
    front_right_m_ = height(wheelbase_m_, -0.5 * track_m_);
  }

  double rear_left_m, rear_right_m;
  double height() const { return 0.5 * (rear_left_m + rear_right_m); }

  /// Rise over distance along x.
  double slope() const {
    return 0.5 * (front_left_m_ + front_right_m_ - rear_left_m - rear_right_m) / wheelbase_m_;
  }
  RigidTransform planarFromGround() const {
    const double bank = 0.5 * (rear_left_m + front_left_m_ - rear_right_m - front_right_m_) / track_m_;
    return RigidTransform(rotationFromYawPitchRoll(0.0, -std::atan(slope()), std::atan(bank)),
                          {0.0, 0.0, height()});
  }

 private:
  double track_m_, wheelbase_m_;
  double front_left_m_, front_right_m_;
};

// Distance along the surface for a horizontal distance (which gives the sign) and a rise.
double alongSurface(double horizontal_m, double rise_m) {
  return std::copysign(std::hypot(horizontal_m, rise_m), horizontal_m);
}

// The car aims to stop this far before a stop, because it follows the desired speed with a delay.
constexpr double kStopReserve_m = 0.4;
constexpr double kStanding_m_per_s = 0.02;
// A car that stands within this distance of the end of the path has arrived.
constexpr double kEnd_m = 1.0;

double desiredSpeed(const DrivePath& path, const VehicleMotionOptions& options, double s_m,
                    double wave_phase_rad) {
  double curvature = 0.0;
  for (double ahead = 0.0; ahead <= kLookAhead_m; ahead += 0.5) {
    curvature = std::max(curvature, std::abs(path.curvature(s_m + ahead)));
  }
  double speed = options.cruise_speed_m_per_s * (1.0 + 0.05 * std::sin(kTwoPi * s_m / 11.0 + wave_phase_rad));
  if (curvature > 0.0) {
    speed = std::min(speed, std::sqrt(kMaxLateralAcceleration_m_per_s2 / curvature));
  }
  if (path.direction(s_m) < 0.0) {
    speed = std::min(speed, kMaxBackwardsSpeed_m_per_s);
  }
  if (options.stop_at_end) {
    speed = std::min(speed, std::sqrt(2.0 * kBraking_m_per_s2 * std::max(0.0, path.length() - 0.2 - s_m)));
  }
  return speed;
}

}  // namespace

VehicleMotion::VehicleMotion(const DrivePath& path, const VehicleMotionOptions& options, uint64_t seed,
                             const GroundHeight& ground_height)
    : options_(options) {
  check(options.cruise_speed_m_per_s > 0.0 && options.duration_s > 0.0,
        "VehicleMotion: cruise speed and duration must be positive");
  Random random(seed);
  const RoadNoise pitch_noise(&random);
  const RoadNoise roll_noise(&random);
  const RoadNoise heave_noise(&random);
  const double wave_phase_rad = random.uniform(0.0, kTwoPi);
  Spring pitch_spring;
  Spring roll_spring;
  Spring heave_spring;

  const bool from_rest = options.standstill_s > 0.0;
  double speed = from_rest ? 0.0 : desiredSpeed(path, options, 0.0, wave_phase_rad);
  // A moving start arrives on a straight line before the path.
  double s_m = from_rest ? 0.0 : -speed * kMargin_s;
  auto stop = path.stops().begin();
  double stop_ends_s = -1.0;  // end of the current stop; negative while driving
  double direction = path.direction(s_m);
  double height_m = options.start_height_m;
  MotionSample sample;
  sample.world_from_planar = path.worldFromStart() * arcMotion(direction * s_m, 0.0);
  int remaining_after_end = 2 * marginSteps();
  for (int step = -marginSteps(); remaining_after_end > 0; ++step) {
    const double time_s = step * kStep_s;
    const bool over = time_s >= options.duration_s || s_m >= path.length() ||
                      (options.stop_at_end && path.length() - s_m < kEnd_m &&
                       time_s > options.standstill_s + 2.0 && speed < 0.01);
    if (over && duration_s_ == 0.0) {
      duration_s_ = time_s;
      remaining_after_end = marginSteps() + 1;
    }
    if (duration_s_ > 0.0) {
      --remaining_after_end;
    }
    if (stop_ends_s >= 0.0 && time_s >= stop_ends_s) {
      // The car may stand slightly before the stop.
      s_m = stop->at_m;
      direction = path.direction(s_m);
      ++stop;
      stop_ends_s = -1.0;
    }
    double acceleration = 0.0;
    if (time_s >= options.standstill_s && time_s >= 0.0 && stop_ends_s < 0.0) {
      double wanted = desiredSpeed(path, options, s_m, wave_phase_rad);
      if (stop != path.stops().end()) {
        wanted = std::min(
            wanted, std::sqrt(2.0 * kBraking_m_per_s2 * std::max(0.0, stop->at_m - kStopReserve_m - s_m)));
      }
      acceleration = std::clamp((wanted - speed) / kSpeedTimeConstant_s, -2.0 * kBraking_m_per_s2,
                                kMaxAcceleration_m_per_s2);
    }
    sample.speed_m_per_s = direction * speed;
    sample.curvature_per_m = path.curvature(s_m);
    const double lateral = speed * speed * sample.curvature_per_m;
    const double load_pitch_rad =
        options.load_pitch_rad ? options.load_pitch_rad(durationFromSeconds(time_s)) : 0.0;
    const double pitch_rad =
        pitch_spring.update(-options.pitch_rad_per_m_per_s2 * (direction * acceleration) - load_pitch_rad) +
        options.road_noise_rad * pitch_noise.at(s_m);
    const double roll_rad =
        roll_spring.update(kRoll_rad_per_m_per_s2 * lateral) + options.road_noise_rad * roll_noise.at(s_m);
    const double height_of_body_m = heave_spring.update(-options.wheelbase_m * load_pitch_rad) +
                                    options.road_heave_m * heave_noise.at(s_m);
    sample.planar_from_body =
        RigidTransform(rotationFromYawPitchRoll(0.0, pitch_rad, roll_rad), {0.0, 0.0, height_of_body_m});
    std::optional<WheelContacts> contacts;
    if (ground_height) {
      contacts.emplace(ground_height, options, sample.world_from_planar, height_m);
      height_m = contacts->height();
      sample.planar_from_body = contacts->planarFromGround() * sample.planar_from_body;
    }
    samples_.push_back(sample);

    double next_speed = std::max(0.0, speed + acceleration * kStep_s);
    const double distance_m = 0.5 * (speed + next_speed) * kStep_s;
    const double horizontal_m = contacts ? distance_m / std::hypot(1.0, contacts->slope()) : distance_m;
    const double turn_rad = path.heading(s_m + horizontal_m) - path.heading(s_m);
    sample.world_from_planar = sample.world_from_planar * arcMotion(direction * horizontal_m, turn_rad);
    double left_m = direction * horizontal_m - 0.5 * options.track_width_m * turn_rad;
    double right_m = direction * horizontal_m + 0.5 * options.track_width_m * turn_rad;
    if (contacts) {
      const WheelContacts next(ground_height, options, sample.world_from_planar, height_m);
      left_m = alongSurface(left_m, next.rear_left_m - contacts->rear_left_m);
      right_m = alongSurface(right_m, next.rear_right_m - contacts->rear_right_m);
    }
    sample.left_wheel_m += left_m;
    sample.right_wheel_m += right_m;
    s_m += horizontal_m;
    const bool arrives =
        stop != path.stops().end() && stop_ends_s < 0.0 && time_s > options.standstill_s &&
        (s_m >= stop->at_m || (next_speed < kStanding_m_per_s && s_m > stop->at_m - 2.0 * kStopReserve_m));
    if (arrives) {
      next_speed = 0.0;
      stop_ends_s = time_s + stop->wait_s;
    }
    speed = next_speed;
  }
}

}  // namespace vcharge
