#pragma once

#include <cstdint>
#include <string>
#include <vector>

#include <Eigen/Core>
#include <opencv2/core.hpp>

#include "vcharge_core/base/timestamp.h"
#include "vcharge_core/files/content_hash.h"
#include "vcharge_core/motion/rigid_transform.h"

namespace vcharge {

/// States of a cell of an ObstacleMap, with the values of nav_msgs/OccupancyGrid. There are no intermediate
/// values: a planner that treats every small value as free would drive into uncertain cells.
inline constexpr int8_t kCellUnobserved = -1;
inline constexpr int8_t kCellFree = 0;
inline constexpr int8_t kCellOccupied = 100;

/// Nearest obstacles around a point on the ground, one entry per direction. Rays start at the origin, in the
/// ground plane; ray i points in the direction angle_min_rad + i * angle_increment_rad (counter-clockwise
/// from the vehicle's x axis) and represents the whole sector of one increment around it.
struct ObstacleScan {
  Timestamp stamp;
  std::string name;                    ///< "fused", or the camera's name
  Eigen::Vector2d origin_m{0.0, 0.0};  ///< in the vehicle frame
  double angle_min_rad = 0.0;
  double angle_increment_rad = 0.0;
  double max_range_m = 0.0;
  /// Range of the nearest obstacle; NaN if none is known, which does not mean free.
  std::vector<float> range_m;
  std::vector<float> range_sigma_m;   ///< one standard deviation; NaN without an obstacle
  std::vector<float> height_m;        ///< height of the obstacle above the ground; NaN without an obstacle
  std::vector<float> height_sigma_m;  ///< NaN without an obstacle
  std::vector<float> free_m;          ///< the ray is observed to be free up to this range; 0: nothing is

  size_t size() const { return range_m.size(); }
  double angle_rad(size_t i) const { return angle_min_rad + static_cast<double>(i) * angle_increment_rad; }
  /// A scan of `count` equal sectors of the full circle, without obstacles and without free space.
  static ObstacleScan unknown(size_t count, double max_range_m);
};

/// Obstacles and free ground on a regular grid around the vehicle. All images have the same size; the corner
/// of column 0, row 0 is at origin_m; columns run along x, rows along y of the fixed frame.
struct ObstacleMap {
  Timestamp stamp;
  std::string frame_id;  ///< the fixed frame, "odom" or "map"
  RigidTransform fixed_from_vehicle;
  double cell_size_m = 0.0;
  Eigen::Vector2d origin_m{0.0, 0.0};  ///< corner of cell (0, 0) in the fixed frame
  cv::Mat state;                       ///< CV_8SC1: kCellUnobserved, kCellFree, kCellOccupied
  /// CV_32FC2: position of the obstacle in an occupied cell, in the fixed frame relative to origin_m; NaN
  /// elsewhere
  cv::Mat point_m;
  cv::Mat point_sigma_m;   ///< CV_32FC1: standard deviation of point_m; NaN elsewhere
  cv::Mat height_m;        ///< CV_32FC1: height above the ground; NaN where not occupied
  cv::Mat height_sigma_m;  ///< CV_32FC1
  /// CV_32FC1: time since the last observation of the cell; NaN: never observed
  cv::Mat age_s;

  /// A map whose cells are all unobserved.
  static ObstacleMap unobserved(cv::Size size_cells, double cell_size_m);
};

/// Adds the whole content of a scan or map; all NaNs are equal.
void addToHash(const ObstacleScan& scan, ContentHasher* hasher);
void addToHash(const ObstacleMap& map, ContentHasher* hasher);

}  // namespace vcharge
