#include <cmath>

#include "sensors/principal_point.h"
#include "vcharge_simulation/rendering/noise.h"
#include "vcharge_simulation/sensors/golf_rig.h"
#include "vcharge_simulation/sensors/rig_catalogue.h"

namespace vcharge {

namespace {

constexpr double kDegree = 3.14159265358979323846 / 180.0;
constexpr double kMaxShift_m = 0.1;
constexpr double kMaxTurn_rad = 10.0 * kDegree;
constexpr double kMeiView_rad = 185.0 * kDegree;
constexpr double kKannalaBrandtView_rad = 190.0 * kDegree;
// For 1280x800 images. The Golf's lens has a radius of 634 px. These circles fit the image even with the
// largest shift of the principal point and the tangential distortion.
constexpr double kMinCircleRadius_px = 590.0;
constexpr double kMaxCircleRadius_px = 628.0;

struct Lens {
  CameraModel model;
  double field_of_view_rad;
};

// Uniform in a ball about the origin.
Eigen::Vector3d inBall(double radius, Random* random) {
  Eigen::Vector3d point;
  do {
    for (int i = 0; i < 3; ++i) {
      point[i] = random->uniform(-1.0, 1.0);
    }
  } while (point.squaredNorm() > 1.0);
  return radius * point;
}

Lens makeMeiLens(double scale, Random* random) {
  const double half_view_rad = 0.5 * kMeiView_rad;
  const double xi = random->uniform(0.9, 1.6);
  // Fisheye lenses lie between the equisolid and the equidistant projection. The radial distortion scales the
  // rim of the unified projection to such a radius; `shrinkage` is the relative change at the rim, split
  // between the second and the fourth power.
  const double rim = std::sin(half_view_rad) / (std::cos(half_view_rad) + xi);
  const double target = random->uniform(1.50, half_view_rad);
  const double shrinkage = target / (rim * (1.0 + xi)) - 1.0;
  const double fourth_power = -random->uniform(0.2, 0.35) * shrinkage;
  const double second_power = shrinkage - fourth_power;
  const double radius_px = scale * random->uniform(kMinCircleRadius_px, kMaxCircleRadius_px);
  const double gamma = radius_px / (rim * (1.0 + shrinkage));
  const double aspect = 1.0 + random->uniform(-0.003, 0.003);
  const Eigen::Vector2d centre_px = randomPrincipalPoint(scale, random);
  MeiCamera::Parameters parameters;
  parameters << xi, gamma, gamma * aspect, centre_px.x(), centre_px.y(), second_power / (rim * rim),
      fourth_power / (rim * rim * rim * rim), 0.0, 0.0;
  parameters[7] = random->uniform(-0.0005, 0.0005);
  parameters[8] = random->uniform(-0.0005, 0.0005);
  return {MeiCamera(parameters), kMeiView_rad};
}

Lens makeKannalaBrandtLens(double scale, Random* random) {
  // k1 = -1/24 is the first term of the equisolid projection, 0 that of the equidistant one.
  const double k1 = random->uniform(-0.04, 0.0);
  const double k2 = random->uniform(-0.002, 0.002);
  const double k3 = random->uniform(-0.0005, 0.0005);
  const double k4 = random->uniform(-0.0001, 0.0001);
  const double angle = 0.5 * kKannalaBrandtView_rad;
  const double s = angle * angle;
  const double rim = angle * (1.0 + s * (k1 + s * (k2 + s * (k3 + s * k4))));
  const double focal_length_px = scale * random->uniform(kMinCircleRadius_px, kMaxCircleRadius_px) / rim;
  const double aspect = 1.0 + random->uniform(-0.003, 0.003);
  const Eigen::Vector2d centre_px = randomPrincipalPoint(scale, random);
  KannalaBrandtCamera::Parameters parameters;
  parameters << focal_length_px, focal_length_px * aspect, centre_px.x(), centre_px.y(), k1, k2, k3, k4;
  return {KannalaBrandtCamera(parameters), kKannalaBrandtView_rad};
}

// Moves and rotates a camera, but never towards the body of the car.
RigidTransform moved(const std::string& name, const RigidTransform& vehicle_from_camera, Random* random) {
  Eigen::Vector3d shift_m = inBall(kMaxShift_m, random);
  const Eigen::Quaterniond turn = rotationFromVector(inBall(kMaxTurn_rad, random));
  const int outward_axis = name == "front" || name == "rear" ? 0 : 1;
  const double outward = name == "front" || name == "left" ? 1.0 : -1.0;
  shift_m[outward_axis] = outward * std::abs(shift_m[outward_axis]);
  return RigidTransform(turn * vehicle_from_camera.rotation(), vehicle_from_camera.translation() + shift_m);
}

}  // namespace

CameraRig makeRandomRig(uint64_t seed, double image_scale) {
  CameraRig rig = makeGolfRig(seed, image_scale);
  // Independent of the random sequence of the Golf's rig.
  Random random(seed ^ 0xD1B54A32D192ED03ULL);
  for (RigCamera& camera : rig.cameras) {
    camera.vehicle_from_camera = moved(camera.name, *camera.vehicle_from_camera, &random);
    const Lens lens =
        random.chance(0.5) ? makeMeiLens(image_scale, &random) : makeKannalaBrandtLens(image_scale, &random);
    camera.model = lens.model;
    camera.field_of_view_rad = lens.field_of_view_rad;
  }
  return rig;
}

}  // namespace vcharge
