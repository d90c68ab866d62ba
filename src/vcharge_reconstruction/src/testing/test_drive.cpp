#include "vcharge_reconstruction/testing/test_drive.h"

#include <cmath>
#include <vector>

namespace vcharge::testing {
namespace {

constexpr double kMaxRange_m = 25.0;
constexpr double kPeriod_s = 0.2;

RigCamera makeCamera(const std::string& name, double yaw_rad, const Eigen::Vector3d& translation_m) {
  KannalaBrandtCamera::Parameters parameters;
  parameters << 200.0, 200.0, 319.5, 199.5, 0.0, 0.0, 0.0, 0.0;
  RigCamera camera{name, "camera_" + name + "_optical", cv::Size(640, 400), KannalaBrandtCamera(parameters)};
  camera.field_of_view_rad = 3.0;
  Eigen::Matrix3d forward_from_optical;
  forward_from_optical << 0.0, 0.0, 1.0, -1.0, 0.0, 0.0, 0.0, -1.0, 0.0;
  camera.vehicle_from_camera = RigidTransform(
      Eigen::AngleAxisd(yaw_rad, Eigen::Vector3d::UnitZ()) * Eigen::Quaterniond(forward_from_optical),
      translation_m);
  return camera;
}

}  // namespace

std::shared_ptr<const CameraRig> makeTestRig() {
  auto rig = std::make_shared<CameraRig>();
  rig->cameras.push_back(makeCamera("front", 0.0, {3.6, 0.0, 0.6}));
  rig->cameras.push_back(makeCamera("left", 1.5707963, {2.0, 0.9, 1.0}));
  return rig;
}

ReconstructionData makeTestDrive(const TestDriveOptions& options) {
  ReconstructionData data;
  auto rig = std::make_shared<CameraRig>(*makeTestRig());
  for (size_t i = 0; i < options.timings.size(); ++i) {
    rig->cameras[i].timing = options.timings[i];
  }
  data.rig = rig;
  std::mt19937 random(options.seed), noise_source(options.seed + 1);
  std::uniform_real_distribution<double> coordinate(-20.0, 20.0), height(-0.2, 4.0);
  std::normal_distribution<double> noise(0.0, options.noise_px);
  RigidTransform map_from_vehicle, odom_from_vehicle;
  for (int i = 0; i < options.num_keyframes; ++i) {
    Keyframe keyframe;
    keyframe.stamp = Timestamp::fromNanoseconds(1'000'000'000LL) + durationFromSeconds(kPeriod_s * i);
    keyframe.map_from_vehicle = map_from_vehicle;
    keyframe.odom_from_vehicle = odom_from_vehicle;
    keyframe.travelled_m = options.step_m * i;
    keyframe.images.resize(data.rig->cameras.size());
    const double hurry = 1.0 + 0.7 * std::sin(0.9 * i);
    keyframe.motion.rates = {hurry * options.step_m / kPeriod_s, hurry * options.turn_rad / kPeriod_s};
    keyframe.motion.image_offsets_s = options.image_offsets_s;
    data.keyframes.push_back(keyframe);
    const double half_rad = 0.5 * options.turn_rad;
    const auto step = [&](double length_m) {
      return RigidTransform::planar(length_m * std::cos(half_rad), length_m * std::sin(half_rad),
                                    options.turn_rad);
    };
    map_from_vehicle = map_from_vehicle * step(options.step_m);
    odom_from_vehicle = odom_from_vehicle * step(options.step_m * options.odometry_scale);
  }
  for (int p = 0; p < options.num_points; ++p) {
    Eigen::Vector3d point;
    point.x() = coordinate(random);
    point.y() = coordinate(random);
    point.z() = height(random);
    for (int32_t camera = 0; camera < static_cast<int32_t>(data.rig->cameras.size()); ++camera) {
      const RigCamera& rig_camera = data.rig->cameras[camera];
      Track track;
      track.position_m = point;
      for (int32_t k = 0; k < options.num_keyframes; ++k) {
        const Eigen::Vector3d in_camera = cameraAt(data.keyframes[k], *data.rig, camera).pointInCamera(point);
        Eigen::Vector2d pixel;
        if (in_camera.norm() < kMaxRange_m && in_camera.norm() > 1.0 &&
            in_camera.z() > std::cos(0.5 * rig_camera.field_of_view_rad) * in_camera.norm() &&
            rig_camera.model.project(in_camera, &pixel) && pixel.x() >= 0.0 && pixel.x() < 640.0 &&
            pixel.y() >= 0.0 && pixel.y() < 400.0) {
          if (options.noise_px > 0.0) {
            pixel.x() += noise(noise_source);
            pixel.y() += noise(noise_source);
          }
          track.observations.push_back({k, camera, -1, pixel, 0.3});
        }
      }
      if (track.observations.size() >= 3) {
        data.tracks.push_back(track);
      }
    }
  }
  return data;
}

}  // namespace vcharge::testing
