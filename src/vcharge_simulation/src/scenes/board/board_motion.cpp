#include "scenes/board/board_motion.h"

#include <algorithm>
#include <cmath>
#include <stdexcept>
#include <string>
#include <utility>

#include "rendering/ray_tracer.h"
#include "vcharge_simulation/rendering/noise.h"

namespace vcharge {

namespace {

constexpr double kPi = 3.14159265358979323846;
constexpr double kToRim_rad =
    0.012;  // angle between the outermost corner of the board and the end of the field of view
constexpr double kToBorder_px = 4.0;
constexpr double kMinHeight_m = 0.08;
constexpr double kMinDistance_m = 0.7;
constexpr double kMaxDistance_m = 2.1;
constexpr double kInnerFraction =
    0.6;  // fraction of poses sampled over the whole image; the rest have a corner at an angle near the rim

class BoardPoseSampler {
 public:
  BoardPoseSampler(const RigCamera& camera, const VehicleBody& body, const Eigen::Vector2d& size_m)
      : camera_(camera),
        body_(body),
        size_m_(size_m),
        max_angle_rad_(0.5 * camera.field_of_view_rad - kToRim_rad) {}

  // Poses in the camera frame, from the image centre to its rim in a fixed mixed order.
  std::vector<RigidTransform> samplePoses(uint64_t seed) const {
    constexpr int kTries = 600;
    Random random(seed);
    std::vector<RigidTransform> sheets;
    for (int i = 0; i < BoardMotion::kPosesPerCamera; ++i) {
      for (int attempt = 0; attempt < kTries; ++attempt) {
        const double fraction =
            (i * 17 % BoardMotion::kPosesPerCamera + random.uniform()) / BoardMotion::kPosesPerCamera;
        const RigidTransform sheet = sample(fraction, &random);
        if (isVisible(sheet)) {
          sheets.push_back(sheet);
          break;
        }
      }
    }
    return sheets;
  }

 private:
  // Samples a pose in some direction from the camera, facing it up to a tilt. With `fraction` near 1 the
  // corners reach the rim.
  RigidTransform sample(double fraction, Random* random) const {
    const double around_rad = random->uniform(0.0, 2.0 * kPi);
    const double distance_m = kMinDistance_m * std::pow(kMaxDistance_m / kMinDistance_m, random->uniform());
    const double roll_rad = random->uniform(-0.6, 0.6);
    const double tilt_x = random->uniform(-0.6, 0.6);
    const double tilt_y = random->uniform(-0.6, 0.6);
    const double extent_rad = std::atan(0.5 * size_m_.norm() / distance_m);
    const double angle_rad = std::max(0.0, max_angle_rad_ - 0.8 * extent_rad) * std::sqrt(fraction);
    const Eigen::Vector3d direction(std::sin(angle_rad) * std::cos(around_rad),
                                    std::sin(angle_rad) * std::sin(around_rad), std::cos(angle_rad));
    const Eigen::Quaterniond facing = Eigen::Quaterniond::FromTwoVectors(Eigen::Vector3d::UnitZ(), direction);
    const Eigen::Quaterniond rotation = facing * rotationFromVector(Eigen::Vector3d(tilt_x, tilt_y, 0.0)) *
                                        rotationFromVector(Eigen::Vector3d(0.0, 0.0, roll_rad));
    const RigidTransform sheet(rotation, distance_m * direction);
    if (fraction < kInnerFraction) {
      return sheet;
    }
    // Rotates the board about the camera until its outermost corner is at the desired angle.
    const double outwards_rad = max_angle_rad_ * std::sqrt(fraction) - outermostAngle(sheet);
    const Eigen::Vector3d axis(-std::sin(around_rad), std::cos(around_rad), 0.0);
    return RigidTransform(rotationFromVector(outwards_rad * axis), Eigen::Vector3d::Zero()) * sheet;
  }

  double outermostAngle(const RigidTransform& camera_from_sheet) const {
    double angle_rad = 0.0;
    for (const double x : {-0.5, 0.5}) {
      for (const double y : {-0.5, 0.5}) {
        const Eigen::Vector3d corner =
            camera_from_sheet * Eigen::Vector3d(x * size_m_.x(), y * size_m_.y(), 0.0);
        angle_rad = std::max(angle_rad, std::atan2(corner.head<2>().norm(), corner.z()));
      }
    }
    return angle_rad;
  }

  bool isVisible(const RigidTransform& camera_from_sheet) const {
    const RigidTransform& vehicle_from_camera = *camera_.vehicle_from_camera;
    const Eigen::Vector3d& eye = vehicle_from_camera.translation();
    for (int row = -2; row <= 2; ++row) {
      for (int column = -2; column <= 2; ++column) {
        const Eigen::Vector3d in_camera =
            camera_from_sheet * Eigen::Vector3d(0.25 * column * size_m_.x(), 0.25 * row * size_m_.y(), 0.0);
        const Eigen::Vector3d in_vehicle = vehicle_from_camera * in_camera;
        Eigen::Vector2d pixel;
        if (std::atan2(in_camera.head<2>().norm(), in_camera.z()) > max_angle_rad_ ||
            in_vehicle.z() < kMinHeight_m || !camera_.model.project(in_camera, &pixel) || !isInImage(pixel) ||
            body_.tracer().occluded(eye.cast<float>(), (in_vehicle - eye).normalized().cast<float>(),
                                    static_cast<float>((in_vehicle - eye).norm() + 0.1))) {
          return false;
        }
      }
    }
    return true;
  }

  bool isInImage(const Eigen::Vector2d& pixel) const {
    return pixel.x() > kToBorder_px && pixel.x() < camera_.image_size_px.width - 1.0 - kToBorder_px &&
           pixel.y() > kToBorder_px && pixel.y() < camera_.image_size_px.height - 1.0 - kToBorder_px;
  }

  const RigCamera& camera_;
  const VehicleBody& body_;
  const Eigen::Vector2d size_m_;
  const double max_angle_rad_;
};

}  // namespace

BoardMotion::BoardMotion(const CameraRig& rig, const VehicleBody& body, const Eigen::Vector2d& board_size_m,
                         const RigidTransform& world_from_vehicle, uint64_t seed) {
  uint64_t number = 0;
  for (const RigCamera& camera : rig.cameras) {
    std::vector<RigidTransform> sheets =
        BoardPoseSampler(camera, body, board_size_m).samplePoses(seed * 10U + number++);
    if (sheets.empty()) {
      throw std::logic_error("BoardMotion: no pose of the board is visible to the camera " + camera.name);
    }
    for (RigidTransform& sheet : sheets) {
      sheet = world_from_vehicle * *camera.vehicle_from_camera * sheet;
    }
    world_from_sheet_.push_back(std::move(sheets));
  }
}

RigidTransform BoardMotion::worldFromSheet(double time_s) const {
  const double in_range_s =
      std::clamp(time_s, 0.0, kSpan_s * static_cast<double>(world_from_sheet_.size()) - 1e-6);
  const auto camera = static_cast<size_t>(in_range_s / kSpan_s);
  const double in_span_s = in_range_s - static_cast<double>(camera) * kSpan_s;
  const std::vector<RigidTransform>& sheets = world_from_sheet_[camera];
  const auto index = static_cast<size_t>(in_span_s / kPose_s);
  const RigidTransform& here = sheets[index % sheets.size()];
  const RigidTransform& next = sheets[(index + 1) % sheets.size()];
  const double held_s = kPose_s - kMove_s;
  const double fraction = (in_span_s - static_cast<double>(index) * kPose_s - held_s) / kMove_s;
  if (fraction <= 0.0) {
    return here;
  }
  const double eased = fraction * fraction * (3.0 - 2.0 * fraction);
  return RigidTransform(here.rotation().slerp(eased, next.rotation()),
                        here.translation() + eased * (next.translation() - here.translation()));
}

}  // namespace vcharge
