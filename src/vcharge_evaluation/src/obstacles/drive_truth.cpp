#include "vcharge_evaluation/drive_truth.h"

#include "vcharge_core/base/error.h"
#include "vcharge_evaluation/range_truth.h"

namespace vcharge {

DriveTruth::DriveTruth(const std::string& folder)
    : folder_(folder),
      rig_(readCameraRig(folder + "/rig.yaml")),
      trajectory_(readTrajectory(folder + "/trajectory.tum")),
      movers_(readTruthMovers(folder + "/movers.yaml")),
      rays_(rig_.cameras.size()) {
  for (const StampedTransform& entry : trajectory_) {
    poses_[entry.stamp] = entry.world_from_vehicle;
  }
  for (const RigCamera& camera : rig_.cameras) {
    if (!camera.vehicle_from_camera) {
      throw InputError(folder + "/rig.yaml: cameras." + camera.name + ": expected vehicle_from_camera");
    }
  }
}

const RigidTransform* DriveTruth::poseAt(Timestamp stamp) const {
  const auto found = poses_.find(stamp);
  return found == poses_.end() ? nullptr : &found->second;
}

std::vector<RigidTransform> DriveTruth::path() const {
  std::vector<RigidTransform> path;
  for (const auto& entry : poses_) {
    path.push_back(entry.second);
  }
  return path;
}

std::vector<SeenPoint> DriveTruth::pointsOf(size_t camera, Timestamp stamp, int step) {
  const RigCamera& seen_by = rig_.cameras[camera];
  const cv::Mat range_m = readRangeTruth(folder_ + "/range", seen_by.name, stamp);
  if (range_m.empty()) {
    return {};
  }
  checkImageSize(seen_by, range_m.size(), folder_ + "/range/" + seen_by.name);
  if (!rays_[camera]) {
    rays_[camera] = std::make_unique<RayTable>(seen_by.model, seen_by.image_size_px,
                                               seen_by.field_of_view_rad, seen_by.mask);
  }
  const RigidTransform& vehicle_from_camera = *seen_by.vehicle_from_camera;
  return makeSeenPoints(range_m, *rays_[camera], poses_.at(stamp) * vehicle_from_camera,
                        travelAt(stamp, vehicle_from_camera), step);
}

std::vector<TruthMover> DriveTruth::moversAt(Timestamp stamp) const {
  const auto found = movers_.find(stamp);
  return found == movers_.end() ? std::vector<TruthMover>() : found->second;
}

std::vector<TruthObstacle> DriveTruth::moversBetween(Timestamp from, Timestamp to) const {
  std::vector<TruthObstacle> all;
  for (auto entry = movers_.lower_bound(from); entry != movers_.end() && entry->first <= to; ++entry) {
    for (const TruthMover& mover : entry->second) {
      all.push_back(mover.obstacle);
    }
  }
  return all;
}

// Direction of a camera's motion at a stamp; zero if it stands.
Eigen::Vector2d DriveTruth::travelAt(Timestamp stamp, const RigidTransform& vehicle_from_camera) const {
  const auto here = poses_.find(stamp);
  const auto next = std::next(here) == poses_.end() ? here : std::next(here);
  const auto previous = here == poses_.begin() ? here : std::prev(here);
  const Eigen::Vector2d motion = ((next->second * vehicle_from_camera).translation() -
                                  (previous->second * vehicle_from_camera).translation())
                                     .head<2>();
  return motion.norm() < 0.01 ? Eigen::Vector2d(0.0, 0.0) : Eigen::Vector2d(motion.normalized());
}

}  // namespace vcharge
