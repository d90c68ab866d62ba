#pragma once

#include <map>
#include <memory>
#include <string>
#include <vector>

#include "vcharge_core/motion/trajectory.h"
#include "vcharge_evaluation/obstacle_truth.h"

namespace vcharge {

/// The truth folder of a simulated drive: poses, movers and what each camera sees. Ranges are read when they
/// are asked for. Not thread safe.
class DriveTruth {
 public:
  /// Reads rig.yaml, trajectory.tum and, where it exists, movers.yaml. InputError naming file and key.
  explicit DriveTruth(const std::string& folder);

  /// Pose at an image; null if no image has this stamp.
  const RigidTransform* poseAt(Timestamp stamp) const;
  std::vector<RigidTransform> path() const;
  const Trajectory& trajectory() const { return trajectory_; }
  const CameraRig& rig() const { return rig_; }

  /// Points of every `step`-th column and row that are visible to a camera; empty without a true range image.
  std::vector<SeenPoint> pointsOf(size_t camera, Timestamp stamp, int step);

  /// Movers at one stamp.
  std::vector<TruthMover> moversAt(Timestamp stamp) const;
  /// Outlines of the movers at all stamps of an interval, its ends included.
  std::vector<TruthObstacle> moversBetween(Timestamp from, Timestamp to) const;

 private:
  Eigen::Vector2d travelAt(Timestamp stamp, const RigidTransform& vehicle_from_camera) const;

  const std::string folder_;
  const CameraRig rig_;
  const Trajectory trajectory_;
  const std::map<Timestamp, std::vector<TruthMover>> movers_;
  std::map<Timestamp, RigidTransform> poses_;
  std::vector<std::unique_ptr<RayTable>> rays_;
};

}  // namespace vcharge
