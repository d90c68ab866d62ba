#include "map_pose/landmark_view.h"

#include <algorithm>
#include <cmath>
#include <unordered_map>
#include <utility>

#include "vcharge_core/camera/moving_camera.h"

namespace vcharge {
namespace {

/// Descriptors are comparable between views whose directions and ranges differ by less.
constexpr double kMaxViewAngle_rad = 0.6;
constexpr double kMaxRangeRatio = 1.8;
/// More than a map can have: landmark and session in one number.
constexpr int64_t kMaxSessions = int64_t{1} << 32;

}  // namespace

int32_t TileObservation::numDrives() const {
  // Observations are ordered by keyframe, and keyframes by drive.
  int32_t num_drives = 0, last = -1;
  const auto [begin, end] = tile->observationsOfLandmark(static_cast<size_t>(get().landmark));
  for (const int32_t* i = begin; i != end; ++i) {
    const int32_t drive = tile->keyframes()[static_cast<size_t>(tile->observations()[*i].keyframe)].session;
    num_drives += drive != last ? 1 : 0;
    last = drive;
  }
  return num_drives;
}

LandmarkView::LandmarkView(const TiledMap& map, const CameraRig& rig, const MapLocalizerOptions& options,
                           const RigidTransform& map_from_vehicle, const FrameMotion& motion)
    : map_(map), rig_(rig), map_from_vehicle_(map_from_vehicle), motion_(motion) {
  for (const size_t keyframe : map.keyframesNear(map_from_vehicle.translation(), options.max_distance_m,
                                                 static_cast<size_t>(options.max_keyframes))) {
    keyframes_.push_back(map.tileOf(keyframe));
  }
}

std::vector<LandmarkView::Source> LandmarkView::sourcesFor(const Eigen::Vector3d& camera_centre) const {
  const double min_cos_view = std::cos(kMaxViewAngle_rad);
  std::unordered_map<int64_t, size_t> source_of_id;
  std::vector<Source> sources;
  for (const auto& [tile, keyframe] : keyframes_) {
    for (size_t camera = 0; camera < map_.rig().cameras.size(); ++camera) {
      const Eigen::Vector3d other_centre = tile->keyframes()[keyframe].map_from_vehicle *
                                           map_.rig().cameras[camera].vehicle_from_camera->translation();
      const auto [begin, end] = tile->observationsOf(keyframe, camera);
      for (size_t i = begin; i < end; ++i) {
        const TileObservation observation = {tile.get(), i};
        const Eigen::Vector3d& point = observation.landmark().position_m;
        const Eigen::Vector3d from_here = point - camera_centre;
        const Eigen::Vector3d from_there = point - other_centre;
        const double range_m = from_here.norm(), other_range_m = from_there.norm();
        const double cos_angle = from_here.dot(from_there) / (range_m * other_range_m);
        if (!(cos_angle >= min_cos_view) || range_m > kMaxRangeRatio * other_range_m ||
            other_range_m > kMaxRangeRatio * range_m) {
          continue;
        }
        const auto [found, is_new] = source_of_id.emplace(
            kMaxSessions * observation.landmark().id + tile->keyframes()[keyframe].session, sources.size());
        if (is_new) {
          sources.push_back({observation, cos_angle});
        } else if (cos_angle > sources[found->second].cos_angle) {
          sources[found->second] = {observation, cos_angle};
        }
      }
    }
  }
  return sources;
}

ExpectedLandmarks LandmarkView::expectedIn(size_t camera) const {
  const RigCamera& rig_camera = rig_.cameras[camera];
  const MovingCamera moving(rig_camera, map_from_vehicle_, motion_.of(camera));
  const double min_cos_field = std::cos(0.5 * rig_camera.field_of_view_rad);
  ExpectedLandmarks expected;
  for (const Source& source : sourcesFor(moving.mapFromCamera().translation())) {
    const Eigen::Vector3d point = moving.pointInCamera(source.observation.landmark().position_m);
    const double range_m = point.norm();
    Eigen::Vector2d pixel;
    if (point.z() >= min_cos_field * range_m && rig_camera.model.project(point, &pixel) && pixel.x() >= 0.0 &&
        pixel.y() >= 0.0 && pixel.x() < rig_camera.image_size_px.width &&
        pixel.y() < rig_camera.image_size_px.height) {
      expected.observations.push_back(source.observation);
      expected.positions_px.emplace_back(static_cast<float>(pixel.x()), static_cast<float>(pixel.y()));
      expected.ranges_m.push_back(range_m);
    }
  }
  return expected;
}

}  // namespace vcharge
