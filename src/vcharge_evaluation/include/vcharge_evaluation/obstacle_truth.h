#pragma once

#include <cstdint>
#include <map>
#include <string>
#include <unordered_map>
#include <vector>

#include <Eigen/Core>
#include <opencv2/core.hpp>

#include "vcharge_core/base/timestamp.h"
#include "vcharge_core/camera/camera_rig.h"
#include "vcharge_core/camera/ray_table.h"
#include "vcharge_core/motion/tracked_object.h"
#include "vcharge_evaluation/outlines.h"

namespace vcharge {

/// A solid object of a simulated scene, in the world frame.
struct TruthObstacle {
  std::string kind;
  Outline footprint_m;
  double base_z_m = 0.0;
  double top_z_m = 0.0;

  double height_m() const { return top_z_m - base_z_m; }
  /// Largest distance between two corners.
  double width_m() const;
  Eigen::Vector2d middle_m() const;
};

/// Reads obstacles.yaml of a simulated drive. InputError naming file and key.
std::vector<TruthObstacle> readTruthObstacles(const std::string& path);

/// An object that can move: what a map of obstacles can tell of it, and the whole object in the world frame,
/// numbered from 1 in the file's order.
struct TruthMover {
  TruthObstacle obstacle;
  TrackedObject object;
};
/// Reads movers.yaml of a simulated drive, by stamp; empty without such a file. InputError naming file, stamp
/// and what is expected.
std::map<Timestamp, std::vector<TruthMover>> readTruthMovers(const std::string& path);

/// Heights of a simulated scene on a grid.
struct TruthHeights {
  cv::Mat height_m;  ///< CV_32FC1; NaN without a surface
  Eigen::Vector2d origin_m{0.0, 0.0};
  double cell_size_m = 0.1;

  /// Value of an image on the same grid at the nearest cell; 0 outside.
  float at(const cv::Mat& image, const Eigen::Vector2d& point_m) const;
};
/// Reads height_map.yaml and the TIFF that it names. InputError naming file and key.
TruthHeights readTruthHeights(const std::string& yaml_path);

/// A surface point visible to a camera, in the world frame.
struct SeenPoint {
  Eigen::Vector3f world_m;
  float from_travel_rad = 0.0F;  ///< horizontal angle to the line of the camera's travel
};

/// Points of every `step`-th column and row of a true range image.
std::vector<SeenPoint> makeSeenPoints(const cv::Mat& range_m, const RayTable& rays,
                                      const RigidTransform& world_from_camera,
                                      const Eigen::Vector2d& travel_in_world, int step);

/// Number of visible points in each 10 cm cell of the world.
class SeenCells {
 public:
  static constexpr double kCell_m = 0.1;
  static int64_t keyOf(const Eigen::Vector2d& point_m);
  static Eigen::Vector2d middleOf(int64_t key);
  void add(const Eigen::Vector2d& point_m, int count = 1) { counts_[keyOf(point_m)] += count; }
  /// Number of points in the cell of a point and the eight around it.
  int countAround(const Eigen::Vector2d& point_m) const;
  const std::unordered_map<int64_t, int>& counts() const { return counts_; }

 private:
  std::unordered_map<int64_t, int> counts_;
};

}  // namespace vcharge
