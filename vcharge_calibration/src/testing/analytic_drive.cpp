#include "testing/analytic_drive.h"

#include <cmath>
#include <memory>
#include <random>
#include <string>

#include "vcharge_reconstruction/testing/test_camera.h"

namespace vcharge::testing {
namespace {

RigCamera makeCamera(const std::string& name, double yaw_rad, const Eigen::Vector3d& position_m) {
  return makeFisheyeCamera(name, 200.0, makeExtrinsics(yaw_rad, 0.35, 0.0, position_m));
}

}  // namespace

ReconstructionData makeAnalyticDrive(uint32_t seed, double noise_px, double lean_rad,
                                     const ImageTiming& timing) {
  ReconstructionData data;
  auto rig = std::make_shared<CameraRig>();
  rig->cameras = {makeCamera("front", 0.0, {3.6, 0.0, 0.6}), makeCamera("left", 1.57, {1.9, 0.95, 0.9})};
  for (RigCamera& camera : rig->cameras) {
    camera.timing = timing;
  }
  data.rig = rig;
  std::mt19937 random(seed);
  std::normal_distribution<double> noise(0.0, 1.0);
  std::uniform_real_distribution<double> uniform(0.0, 1.0);
  constexpr int kHalf = 76;
  RigidTransform map_from_vehicle, odom_from_vehicle;
  for (int i = 0; i < 2 * kHalf; ++i) {
    const double side = i < kHalf ? 1.0 : -1.0;
    Keyframe keyframe;
    keyframe.map_from_vehicle =
        map_from_vehicle *
        RigidTransform(rotationFromYawPitchRoll(0.0, 0.0, side * lean_rad), Eigen::Vector3d::Zero());
    keyframe.odom_from_vehicle = odom_from_vehicle;
    keyframe.travelled_m = 0.5 * i;
    keyframe.images.resize(rig->cameras.size());
    const double turn_rad = side * 0.5 / 6.0;
    const double speed_m_per_s = 2.5 + 1.5 * std::sin(0.4 * i);
    keyframe.motion.rates = {speed_m_per_s, turn_rad / 0.5 * speed_m_per_s};
    data.keyframes.push_back(keyframe);
    map_from_vehicle = map_from_vehicle * RigidTransform::planar(0.5 * std::cos(0.5 * turn_rad),
                                                                 0.5 * std::sin(0.5 * turn_rad), turn_rad);
    const double length_m = 0.5 + 0.002 * noise(random);
    const double side_m = 0.002 * noise(random);
    const double counted_rad = turn_rad + 0.0005 * noise(random);
    odom_from_vehicle =
        odom_from_vehicle *
        RigidTransform::planar(length_m * std::cos(0.5 * turn_rad) - side_m * std::sin(0.5 * turn_rad),
                               length_m * std::sin(0.5 * turn_rad) + side_m * std::cos(0.5 * turn_rad),
                               counted_rad);
  }
  for (int p = 0; p < 1500; ++p) {
    const double x = -12.0 + 24.0 * uniform(random);
    const double y = -18.0 + 36.0 * uniform(random);
    const bool is_ground = uniform(random) < 0.5;
    const double z = is_ground ? 0.01 * noise(random) : 0.5 + 3.0 * uniform(random);
    Track track;
    track.position_m = Eigen::Vector3d(x, y, z);
    for (int32_t k = 0; k < static_cast<int32_t>(data.keyframes.size()); ++k) {
      for (int32_t c = 0; c < 2; ++c) {
        const RigCamera& camera = rig->cameras[c];
        const Eigen::Vector3d in_camera =
            cameraAt(data.keyframes[k], *data.rig, c).pointInCamera(*track.position_m);
        Eigen::Vector2d pixel;
        if (in_camera.norm() < 10.0 && in_camera.norm() > 0.5 && in_camera.z() > 0.1 * in_camera.norm() &&
            camera.model.project(in_camera, &pixel) && pixel.x() >= 0.0 && pixel.x() < 640.0 &&
            pixel.y() >= 0.0 && pixel.y() < 400.0) {
          const double du = noise_px * noise(random);
          const double dv = noise_px * noise(random);
          track.observations.push_back({k, c, -1, pixel + Eigen::Vector2d(du, dv), kNoise_px});
        }
      }
    }
    if (track.observations.size() >= 3) {
      data.tracks.push_back(track);
    }
  }
  return data;
}

}  // namespace vcharge::testing
