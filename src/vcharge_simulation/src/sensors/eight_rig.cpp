#include <string>

#include "sensors/principal_point.h"
#include "vcharge_simulation/rendering/noise.h"
#include "vcharge_simulation/sensors/golf_rig.h"
#include "vcharge_simulation/sensors/rig_catalogue.h"

namespace vcharge {

namespace {

constexpr double kDegree = 3.14159265358979323846 / 180.0;
constexpr double kMaxShift_m = 0.05;
constexpr double kMaxTurn_rad = 5.0 * kDegree;

CameraModel makePinhole(double scale, Random* random) {
  const Eigen::Vector2d centre_px = randomPrincipalPoint(scale, random);
  const double focal_length_px = scale * random->uniform(690.0, 710.0);
  PinholeCamera::Parameters parameters;
  parameters << focal_length_px, focal_length_px, centre_px.x(), centre_px.y(), random->uniform(-0.05, 0.0),
      random->uniform(0.0, 0.005), random->uniform(-0.0005, 0.0005), random->uniform(-0.0005, 0.0005);
  return PinholeCamera(parameters);
}

CameraModel makeKannalaBrandt(double scale, Random* random) {
  const Eigen::Vector2d centre_px = randomPrincipalPoint(scale, random);
  const double focal_length_px = scale * random->uniform(590.0, 610.0);
  KannalaBrandtCamera::Parameters parameters;
  parameters << focal_length_px, focal_length_px, centre_px.x(), centre_px.y(), random->uniform(-0.04, 0.0),
      random->uniform(-0.002, 0.002), 0.0, 0.0;
  return KannalaBrandtCamera(parameters);
}

}  // namespace

CameraRig makeEightRig(uint64_t seed, double image_scale) {
  CameraRig rig = makeGolfRig(seed, image_scale);
  Random random(seed ^ 0x9E3779B97F4A7C15ULL);  // independent of the random sequence of the Golf's rig
  const auto add = [&](const std::string& name, double yaw_degrees, double down_degrees,
                       const Eigen::Vector3d& position_m, const CameraModel& model, double view_degrees) {
    const auto small = [&](double size) {
      return Eigen::Vector3d(random.uniform(-size, size), random.uniform(-size, size),
                             random.uniform(-size, size));
    };
    const Eigen::Quaterniond rotation(rotationTowards(yaw_degrees * kDegree, down_degrees * kDegree));
    RigCamera camera = rig.cameras.front();
    camera.name = name;
    camera.frame_id = "camera_" + name + "_optical";
    camera.model = model;
    camera.field_of_view_rad = view_degrees * kDegree;
    camera.vehicle_from_camera =
        RigidTransform(rotationFromVector(small(kMaxTurn_rad)) * rotation, position_m + small(kMaxShift_m));
    rig.cameras.push_back(camera);
  };
  add("roof", 0.0, 8.0, {1.45, 0.0, 1.60}, makePinhole(image_scale, &random), 100.0);
  add("trailer", 180.0, 40.0, {-0.95, 0.15, 1.05}, makeKannalaBrandt(image_scale, &random), 130.0);
  add("left_pillar", 125.0, 15.0, {2.5, 1.0, 1.0}, makePinhole(image_scale, &random), 100.0);
  add("right_pillar", -125.0, 15.0, {2.5, -1.0, 1.0}, makePinhole(image_scale, &random), 100.0);
  return rig;
}

}  // namespace vcharge
