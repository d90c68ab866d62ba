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

/// States of a cell of an ObstacleMap, with the values of nav_msgs/OccupancyGrid. Nothing lies between: a
/// planner that takes every small value for free would drive into what is not sure.
inline constexpr int8_t kCellUnobserved = -1;
inline constexpr int8_t kCellFree = 0;
inline constexpr int8_t kCellOccupied = 100;

/// What stands around a point on the ground, one entry per direction. Rays start at the origin, in the plane
/// of the ground; ray i looks in the direction angle_min_rad + i * angle_increment_rad (counter-clockwise
/// from the vehicle's x axis) and speaks for the whole sector of one increment around it.
struct ObstacleScan {
  Timestamp stamp;
  std::string name;                    ///< "fused", or the camera's
  Eigen::Vector2d origin_m{0.0, 0.0};  ///< in the vehicle frame
  double angle_min_rad = 0.0;
  double angle_increment_rad = 0.0;
  double max_range_m = 0.0;
  std::vector<float> range_m;         ///< of the nearest obstacle; NaN: none known (that is not free)
  std::vector<float> range_sigma_m;   ///< one standard deviation; NaN without an obstacle
  std::vector<float> height_m;        ///< how far the obstacle rises above the ground; NaN without
  std::vector<float> height_sigma_m;  ///< NaN without an obstacle
  std::vector<float> free_m;          ///< seen free from near the vehicle up to here; 0: nothing

  size_t size() const { return range_m.size(); }
  double angle_rad(size_t i) const { return angle_min_rad + static_cast<double>(i) * angle_increment_rad; }
  /// All rays without an obstacle and nothing free: `count` equal sectors of the full circle.
  static ObstacleScan unknown(size_t count, double max_range_m);
};

/// Obstacles and free ground on a regular grid around the vehicle. All images have one size; column 0 and
/// row 0 begin at origin_m, columns run along x, rows along y of the fixed frame.
struct ObstacleMap {
  Timestamp stamp;
  std::string frame_id;  ///< the fixed frame, "odom" or "map"
  RigidTransform fixed_from_vehicle;
  double cell_size_m = 0.0;
  Eigen::Vector2d origin_m{0.0, 0.0};  ///< corner of cell (0, 0) in the fixed frame
  cv::Mat state;                       ///< CV_8SC1: kCellUnobserved, kCellFree, kCellOccupied
  cv::Mat point_m;                     ///< CV_32FC2: where in the fixed frame the obstacle of an occupied
                                       ///< cell is, from origin_m; NaN in others
  cv::Mat point_sigma_m;               ///< CV_32FC1: its standard deviation; NaN in others
  cv::Mat height_m;                    ///< CV_32FC1: above the ground; NaN where not occupied
  cv::Mat height_sigma_m;              ///< CV_32FC1
  cv::Mat age_s;                       ///< CV_32FC1: since the cell was last seen; NaN: never

  /// All cells unobserved.
  static ObstacleMap unobserved(cv::Size size_cells, double cell_size_m);
};

/// Adds all that is in a scan or map; every NaN counts the same.
void addToHash(const ObstacleScan& scan, ContentHasher* hasher);
void addToHash(const ObstacleMap& map, ContentHasher* hasher);

}  // namespace vcharge
