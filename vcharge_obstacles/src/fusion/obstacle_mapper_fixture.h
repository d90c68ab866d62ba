#pragma once

#include <algorithm>
#include <memory>
#include <string>
#include <vector>

#include <gtest/gtest.h>

#include "detection/box_world.h"
#include "fusion/obstacle_map_cells.h"
#include "vcharge_obstacles/obstacle_mapper.h"

namespace vcharge {

inline constexpr double kSpeed_m_per_s = 1.25;  // 0.1 m per image
inline constexpr double kDegree = M_PI / 180.0;
inline const BoxWorld kWorld{{{{3.0, 2.5, 0.0}, {3.5, 3.0, 1.2}}}};

/// A drive along x with odometry at 50 Hz, range maps at 12.5 Hz, and faults that the test sets.
class ObstacleMapperTest : public ::testing::Test {
 protected:
  void start() {
    frames_.clear();
    mapper_ = std::make_unique<ObstacleMapper>(
        rig_, options_, [this](const ObstacleFrame& frame) { frames_.push_back(frame); });
  }
  static Timestamp stampAt(int tick) { return Timestamp::fromNanoseconds(1000000000LL + 20000000LL * tick); }

  /// The true pose at a tick of 20 ms, with the roll that the test sets.
  RigidTransform poseAt(int tick) const {
    const double x = std::min(tick, stops_at_) * 0.02 * kSpeed_m_per_s;
    return RigidTransform(rotationFromYawPitchRoll(0.0, 0.0, roll_rad_), Eigen::Vector3d(x, 0.0, 0.0));
  }
  void addOdometry(int tick, double x_m) {
    VehicleOdometry odometry;
    odometry.stamp = stampAt(tick);
    odometry.odom_from_vehicle = RigidTransform::planar(x_m, 0.0, 0.0);
    mapper_->addOdometry(odometry);
  }
  /// Odometry along the true poses.
  void addOdometry(int tick) { addOdometry(tick, poseAt(tick).translation().x()); }
  RangeMap measure(size_t camera, int tick, const BoxWorldNoise& noise = {}) const {
    return measureBoxWorld(world_, rig_->cameras[camera], poseAt(tick), stampAt(tick), noise);
  }
  void addRangeMaps(int tick, const BoxWorldNoise& noise = {}) {
    for (size_t camera = 0; camera < rig_->cameras.size(); ++camera) {
      mapper_->addRangeMap(measure(camera, tick, noise));
    }
  }
  void drive(int from_tick, int to_tick) {
    for (int tick = from_tick; tick < to_tick; ++tick) {
      addOdometry(tick, poseAt(tick).translation().x() + (tick >= jumps_at_ ? jump_m_ : 0.0));
      if (tick % 4 == 0 && notes_images_) {
        noteImages(tick);
      }
      if (tick % 4 != 0 || tick >= stops_at_) {
        continue;
      }
      for (const RigCamera& camera : rig_->cameras) {
        if (camera.name == dead_camera_ && tick >= dead_from_ && tick < recovers_at_) {
          continue;
        }
        BoxWorldNoise noise{0.01, camera.name == blind_camera_ && tick >= dead_from_ ? 1.0 : 0.1,
                            static_cast<uint32_t>(tick)};
        mapper_->addRangeMap(measureBoxWorld(world_, camera, poseAt(tick), stampAt(tick), noise));
      }
    }
  }
  /// Images of all cameras, except a dead one; a frozen one repeats its image from dead_from_ on.
  void noteImages(int tick) {
    for (size_t camera = 0; camera < rig_->cameras.size(); ++camera) {
      const bool fails = tick >= dead_from_ && tick < recovers_at_;
      const bool is_frozen = fails && rig_->cameras[camera].name == frozen_camera_;
      if (!fails || rig_->cameras[camera].name != dead_camera_) {
        mapper_->noteImage(camera, stampAt(tick), static_cast<uint64_t>(is_frozen ? dead_from_ : tick));
      }
    }
  }
  static int count(const ObstacleFrame& frame, int8_t state) { return countCells(frame.map, state); }
  static int8_t stateAt(const ObstacleFrame& frame, double x_m, double y_m) {
    return stateIn(frame.map, x_m, y_m);
  }
  /// Number of cells beyond min_y_m that became free between two frames.
  static int newlyFree(const ObstacleFrame& before, const ObstacleFrame& after, double min_y_m) {
    int newly = 0;
    for (int row = 0; row < after.map.state.rows; ++row) {
      for (int column = 0; column < after.map.state.cols; ++column) {
        const Eigen::Vector2d middle_m =
            after.map.origin_m + after.map.cell_size_m * Eigen::Vector2d(column + 0.5, row + 0.5);
        const Eigen::Vector2d cell = (middle_m - before.map.origin_m) / before.map.cell_size_m;
        const bool known_before = cell.x() >= 0 && cell.y() >= 0 && cell.x() < before.map.state.cols &&
                                  cell.y() < before.map.state.rows;
        const bool was_free = known_before && stateIn(before.map, middle_m.x(), middle_m.y()) == kCellFree;
        newly += middle_m.y() > min_y_m && !was_free && after.map.state.at<int8_t>(row, column) == kCellFree
                     ? 1
                     : 0;
      }
    }
    return newly;
  }
  /// A rig without the front camera, which observes both sides.
  static std::shared_ptr<const CameraRig> makeSideRig() {
    CameraRig rig = makeBoxWorldRig();
    rig.cameras.erase(rig.cameras.begin());
    return std::make_shared<const CameraRig>(rig);
  }
  /// Number of free cells within 1 m of the side cameras along x, and at y from min_y_m to 3 m more.
  int countFreeBeside(double min_y_m) const {
    const double middle = frames_.back().map.fixed_from_vehicle.translation().x() + 1.9;
    int free = 0;
    for (double x = middle - 1.0; x < middle + 1.0; x += 0.1) {
      for (double y = min_y_m + 0.05; y < min_y_m + 3.0; y += 0.1) {
        free += stateAt(frames_.back(), x, y) == kCellFree ? 1 : 0;
      }
    }
    return free;
  }
  const ObstacleCameraStatus& statusOf(const std::string& camera) const {
    return *std::find_if(frames_.back().status.begin(), frames_.back().status.end(),
                         [&](const ObstacleCameraStatus& status) { return status.camera_name == camera; });
  }

  BoxWorld world_ = kWorld;
  std::shared_ptr<const CameraRig> rig_ = std::make_shared<const CameraRig>(makeBoxWorldRig());
  ObstacleMapperOptions options_;
  std::unique_ptr<ObstacleMapper> mapper_;
  std::vector<ObstacleFrame> frames_;
  int stops_at_ = 100000, jumps_at_ = 100000, dead_from_ = 0, recovers_at_ = 100000;
  bool notes_images_ = false;
  double jump_m_ = 0.0, roll_rad_ = 0.0;
  std::string dead_camera_, blind_camera_, frozen_camera_;
};

}  // namespace vcharge
