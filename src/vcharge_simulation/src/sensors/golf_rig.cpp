#include "vcharge_simulation/sensors/golf_rig.h"

#include <cmath>
#include <map>
#include <stdexcept>
#include <utility>

#include "vcharge_simulation/objects/car_model.h"
#include "vcharge_simulation/rendering/noise.h"

namespace vcharge {

namespace {

constexpr double kFieldOfView_rad = 3.2289;
constexpr double kPi = 3.14159265358979323846;
const cv::Size kFullSize(1280, 800);

// Left mirror camera of the V-Charge car. Its published lateral position (1.40 m) refers to an origin off the
// car's middle plane, so the mirror of a Golf (0.98 m) is used instead.
constexpr double kXi = 1.1584422115726898;
constexpr double kGamma1 = 895.54818314068166;
constexpr double kGamma2 = 894.74426130897348;
constexpr double kU0 = 649.62356964542516;
constexpr double kV0 = 398.71903485692013;
constexpr double kK1 = -0.33084335078197569;
constexpr double kK2 = 0.086519827528324378;
constexpr double kP1 = -0.00067678740380559344;
constexpr double kP2 = -0.000036412961593787842;
const Eigen::Vector3d kLeftTranslation_m(1.9071, 0.98, 0.8994);

Eigen::Matrix3d leftRotation() {
  Eigen::Matrix3d rotation;
  rotation << 0.9971696119, 0.0174865783, 0.0731230786,  //
      -0.0428662883, -0.6667851656, 0.7440161452,        //
      0.0617676807, -0.7450448058, -0.6641483201;
  return rotation;
}

RigidTransform disturbed(const Eigen::Matrix3d& rotation, const Eigen::Vector3d& translation_m,
                         Random* random) {
  constexpr double kTilt_rad = 0.015;
  constexpr double kShift_m = 0.01;
  const auto small = [&](double size) {
    const double x = random->uniform(-size, size);
    const double y = random->uniform(-size, size);
    const double z = random->uniform(-size, size);
    return Eigen::Vector3d(x, y, z);
  };
  const Eigen::Quaterniond turn = rotationFromVector(small(kTilt_rad));
  return RigidTransform(turn * Eigen::Quaterniond(rotation), translation_m + small(kShift_m));
}

MeiCamera makeLens(double scale, Random* random) {
  MeiCamera::Parameters parameters;
  const auto about = [&](double value, double spread) { return value + random->uniform(-spread, spread); };
  parameters << about(kXi, 0.008), about(kGamma1, 3.0), about(kGamma2, 3.0), about(kU0, 5.0), about(kV0, 4.0),
      about(kK1, 0.004), about(kK2, 0.003), about(kP1, 0.0005), about(kP2, 0.0005);
  // Pixel centres have integer coordinates, so the image starts at -0.5.
  parameters[1] *= scale;
  parameters[2] *= scale;
  parameters[3] = (parameters[3] + 0.5) * scale - 0.5;
  parameters[4] = (parameters[4] + 0.5) * scale - 0.5;
  return MeiCamera(parameters);
}

// Cameras further from the middle plane are in the mirrors.
constexpr double kSideCamera_m = 0.8;

struct Paint {
  float albedo, reflectivity;
};

CarMaterials makeMaterials(const Paint& paint, std::vector<Material>* materials) {
  const auto add = [&](float albedo, float reflectivity) {
    Material material;
    material.albedo = albedo;
    material.reflectivity = reflectivity;
    material.kind = SurfaceKind::kCar;
    materials->push_back(material);
    return static_cast<uint32_t>(materials->size() - 1);
  };
  CarMaterials car{};
  car.paint = add(paint.albedo, paint.reflectivity);
  car.side = car.front = car.rear = car.plate = car.paint;
  car.glass = add(0.02F, 0.05F);
  car.trim = car.tyre = add(0.03F, 0.0F);
  car.wheel = add(0.25F, 0.02F);
  return car;
}

}  // namespace

Eigen::Matrix3d rotationTowards(double yaw_rad, double down_rad) {
  const Eigen::Vector3d z(std::cos(down_rad) * std::cos(yaw_rad), std::cos(down_rad) * std::sin(yaw_rad),
                          -std::sin(down_rad));
  const Eigen::Vector3d x(std::sin(yaw_rad), -std::cos(yaw_rad), 0.0);
  Eigen::Matrix3d rotation;
  rotation << x, z.cross(x), z;
  return rotation;
}

CameraRig makeGolfRig(uint64_t seed, double image_scale) {
  if (!(image_scale > 0.0 && image_scale <= 1.0)) {
    throw std::invalid_argument("image_scale: must be in (0, 1], is " + std::to_string(image_scale));
  }
  Random random(seed);
  const Eigen::Matrix3d mirror_vehicle = Eigen::Vector3d(1.0, -1.0, 1.0).asDiagonal();
  const Eigen::Matrix3d mirror_camera = Eigen::Vector3d(-1.0, 1.0, 1.0).asDiagonal();
  const Eigen::Matrix3d right = mirror_vehicle * leftRotation() * mirror_camera;
  const std::vector<std::pair<std::string, RigidTransform>> mountings = {
      {"front", disturbed(rotationTowards(0.0, 0.35), {3.6, 0.0, 0.6}, &random)},
      {"left", RigidTransform(Eigen::Quaterniond(leftRotation()), kLeftTranslation_m)},
      {"rear", disturbed(rotationTowards(kPi, 0.45), {-0.9, 0.0, 0.8}, &random)},
      {"right", disturbed(right, mirror_vehicle * kLeftTranslation_m, &random)}};
  CameraRig rig;
  for (const auto& [name, vehicle_from_camera] : mountings) {
    RigCamera camera{name,
                     "camera_" + name + "_optical",
                     cv::Size(static_cast<int>(std::lround(kFullSize.width * image_scale)),
                              static_cast<int>(std::lround(kFullSize.height * image_scale))),
                     makeLens(image_scale, &random),
                     kFieldOfView_rad,
                     "",
                     cv::Mat(),
                     vehicle_from_camera,
                     std::nullopt};
    rig.cameras.push_back(camera);
  }
  return rig;
}

CameraRig makeRecessedRig(uint64_t seed, double image_scale) {
  CameraRig rig = makeGolfRig(seed, image_scale);
  const std::map<std::string, Eigen::Vector3d> positions_m = {{"front", {3.38, 0.0, 0.80}},
                                                              {"left", {1.80, 0.96, 1.02}},
                                                              {"rear", {-0.66, 0.0, 1.04}},
                                                              {"right", {1.80, -0.96, 1.02}}};
  for (RigCamera& camera : rig.cameras) {
    camera.vehicle_from_camera =
        RigidTransform::fromUnit(camera.vehicle_from_camera->rotation(), positions_m.at(camera.name));
  }
  return rig;
}

std::shared_ptr<const VehicleBody> makeGolfBody() {
  const Paint paint{0.035F, 0.05F};
  std::vector<Material> materials;
  const CarMaterials car = makeMaterials(paint, &materials);
  return std::make_shared<VehicleBody>(makeCarMesh(carShapes().front(), car, false), materials);
}

std::shared_ptr<const VehicleBody> makeGlossyBody(const CameraRig& rig, uint64_t seed) {
  Random random(seed ^ 0xA24BAED4963EE407ULL);
  const Paint paint{static_cast<float>(0.03 * std::pow(20.0, random.uniform(0.0, 1.0))), 0.045F};
  std::vector<Material> materials;
  const CarMaterials car = makeMaterials(paint, &materials);
  TriangleMesh mesh = makeCarMesh(carShapes().front(), car, false);
  for (const RigCamera& camera : rig.cameras) {
    const Eigen::Vector3d position_m = camera.vehicle_from_camera->translation();
    if (std::abs(position_m.y()) > kSideCamera_m) {
      const double outwards = position_m.y() > 0.0 ? 1.0 : -1.0;
      addBox(placement(position_m.x() - 0.12, position_m.y() - 0.06 * outwards, position_m.z() + 0.05, 0.0),
             {0.16F, 0.16F, 0.12F}, car.paint, &mesh);
    }
  }
  return std::make_shared<VehicleBody>(std::move(mesh), materials, true);
}

}  // namespace vcharge
