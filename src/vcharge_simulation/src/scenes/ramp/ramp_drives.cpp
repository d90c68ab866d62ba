#include "scenes/lane_paths.h"
#include "scenes/ramp/ramp_shape.h"
#include "scenes/scene_builders.h"

namespace vcharge {

namespace {

constexpr double kHalfPi = 1.57079632679489661923;
constexpr double kTransition_m = 3.0;  // clothoids at both ends, half of each on the ramp
constexpr double kApproach_m = 12.0;
constexpr double kOnLanding_m = 8.0;
constexpr double kCurvature_per_m = 1.0 / kRampRadius_m;
// A clothoid shifts the arc inwards.
constexpr double kShift_m = kTransition_m * kTransition_m / (24.0 * kRampRadius_m);
constexpr double kArc_m = kRampLength_m - kTransition_m;

DrivePlan upwards() {
  constexpr double k = kCurvature_per_m;
  const RigidTransform start =
      RigidTransform::planar(kRampRadius_m + kShift_m, -kApproach_m - 0.5 * kTransition_m, kHalfPi);
  return {"",
          DrivePath(start, {{kApproach_m, 0.0, 0.0},
                            {kTransition_m, 0.0, k},
                            {kArc_m, k, k},
                            {kTransition_m, k, 0.0},
                            {kOnLanding_m, 0.0, 0.0}}),
          fromRestToRest(), 0, rampGroundHeight};
}

DrivePlan downwards() {
  constexpr double k = -kCurvature_per_m;
  const RigidTransform start =
      RigidTransform::planar(-kOnLanding_m - 0.5 * kTransition_m, kRampRadius_m + kShift_m, 0.0);
  DrivePlan plan{"",
                 DrivePath(start, {{kOnLanding_m, 0.0, 0.0},
                                   {kTransition_m, 0.0, k},
                                   {kArc_m, k, k},
                                   {kTransition_m, k, 0.0},
                                   {kApproach_m, 0.0, 0.0}}),
                 fromRestToRest(), 0, rampGroundHeight};
  plan.motion.start_height_m = landingHeight();
  return plan;
}

}  // namespace

std::vector<SceneDrive> rampDrives() {
  return {{{"up", "from the ground up the ramp to the landing"}, upwards},
          {{"down", "from the landing down to the ground"}, downwards}};
}

}  // namespace vcharge
