#pragma once

#include <memory>
#include <string>
#include <vector>

#include <Eigen/Core>

#include "vcharge_core/camera/working_camera.h"
#include "vcharge_core/dense_maps/obstacle_map.h"
#include "vcharge_core/dense_maps/range_map.h"
#include "vcharge_obstacles/ground_plane.h"
#include "vcharge_obstacles/polar_grid.h"

namespace vcharge {

/// Options of ObstacleDetector. Heights are above the ground.
struct ObstacleDetectorOptions {
  PolarGridOptions grid;
  GroundPlaneOptions ground;
  int pixel_step = 1;               ///< every how many columns and rows a pixel is looked at
  double min_height_m = 0.08;       ///< what rises less is ground
  double max_height_m = 2.0;        ///< what hangs higher is no obstacle: the vehicle passes below it
  double reference_height_m = 0.2;  ///< of the obstacle whose pixels the supports are compared with
  double min_confidence = 0.4;      ///< of a range that counts
  double max_relative_sigma = 0.3;  ///< of a range that counts
  double min_support = 0.3;         ///< share of the reference obstacle's pixels in a sector
  double min_support_behind = 0.5;  ///< the same of an obstacle behind another one on its ray
  double min_points = 3.0;          ///< and so many, weighted by confidence
  double min_ratio = 0.4;           ///< obstacle points over all points of the cell
  double min_separation_m = 0.4;    ///< between two obstacles on one ray
  int max_obstacles_per_ray = 3;
  /// What is seen further from the optical axis than this, from above, and is not near, hides ground but
  /// marks no obstacle in the map: there the lens resolves little, and another camera sees better.
  double max_off_axis_rad = 1.1;
  double max_off_axis_range_m = 2.5;
  /// So far off the axis, and beyond this range, ground keeps free what is free and takes back what is
  /// occupied, but makes nothing free: there ranges of a dark flank may be those of the ground.
  double max_off_axis_free_m = 1.5;
  /// Between a low thing and a high one behind it the ranges leave a gap. Where they rise without one from a
  /// height up to max_ramp_height_m to something higher within max_ramp_length_m, windows of the range map
  /// saw the high thing, its shadow and the ground before it at once, and made a ramp of them.
  double max_ramp_height_m = 0.3;
  double max_ramp_length_m = 1.3;
  double ramp_weight = 0.25;  ///< of a look at such a ramp in the map: it may be a kerb after all
  /// Points of this mean confidence make a full look in the map; less sure ones weigh by their log odds.
  double reference_confidence = 0.9;
  double sure_ground_sigmas = 1.0;  ///< a ground point lies so far below min_height_m
  double below_ground_m = 0.08;     ///< deeper points are wrong ranges, not ground
  /// Where the ground is not known, an obstacle rises above all that a tilt of this size explains.
  double lost_ground_tilt_rad = 0.0873;
  /// The vehicle's own outline in its frame: points in it are of itself.
  double vehicle_front_m = 3.75;
  double vehicle_rear_m = -0.95;
  double vehicle_half_width_m = 0.95;

  template <class Visitor>
  void visitFields(Visitor&& visit) {
    visit("grid", grid);
    visit("ground", ground);
    visit("pixel_step", pixel_step);
    visit("min_height_m", min_height_m);
    visit("max_height_m", max_height_m);
    visit("reference_height_m", reference_height_m);
    visit("min_confidence", min_confidence);
    visit("max_relative_sigma", max_relative_sigma);
    visit("min_support", min_support);
    visit("min_support_behind", min_support_behind);
    visit("min_points", min_points);
    visit("min_ratio", min_ratio);
    visit("min_separation_m", min_separation_m);
    visit("max_obstacles_per_ray", max_obstacles_per_ray);
    visit("max_off_axis_rad", max_off_axis_rad);
    visit("max_off_axis_range_m", max_off_axis_range_m);
    visit("max_off_axis_free_m", max_off_axis_free_m);
    visit("max_ramp_height_m", max_ramp_height_m);
    visit("max_ramp_length_m", max_ramp_length_m);
    visit("ramp_weight", ramp_weight);
    visit("reference_confidence", reference_confidence);
    visit("sure_ground_sigmas", sure_ground_sigmas);
    visit("below_ground_m", below_ground_m);
    visit("lost_ground_tilt_rad", lost_ground_tilt_rad);
    visit("vehicle_front_m", vehicle_front_m);
    visit("vehicle_rear_m", vehicle_rear_m);
    visit("vehicle_half_width_m", vehicle_half_width_m);
  }
  void validate() const;  ///< throws std::invalid_argument naming the field
};

/// Something that stands on the ground (or hangs low above it) in one sector of a camera.
struct PolarObstacle {
  int ray = 0;
  double range_m = 0.0;  ///< horizontal, from the camera; refined by the points in the cell
  double range_sigma_m = 0.0;
  double height_m = 0.0;  ///< of its highest part that was seen
  double height_sigma_m = 0.0;
  double bottom_m = 0.0;     ///< height of its lowest part that was seen
  bool is_off_axis = false;  ///< beyond max_off_axis_rad and max_off_axis_range_m
  bool is_ramp = false;      ///< rises towards something higher without a gap: rather a smear of the ranges
  double support = 0.0;      ///< its points over those of the reference obstacle, at most 1
  double weight = 1.0;       ///< of the look in the map
};

/// What one range map says about the ground around the camera.
struct CameraObstacles {
  Timestamp stamp;
  std::string camera_name;
  Eigen::Vector2d origin_m{0.0, 0.0};  ///< the camera in the vehicle frame
  double camera_height_m = 0.0;
  GroundPlane ground;
  double known_share = 0.0;              ///< of the camera's valid pixels that have a range
  std::vector<PolarObstacle> obstacles;  ///< by ray, then by range
  /// Range up to which bare ground makes a cell free, by ray; empty: everywhere. Beyond, seen too far off the
  /// axis, it keeps free what is free, and takes back what is occupied.
  std::vector<double> free_to_m;
  /// Evidence that the ground of a cell is bare, by PolarGrid::index: 0 none, 1 all of the pixels that show
  /// it lie on the ground.
  std::vector<float> free_share;
  /// Evidence against bare ground, by PolarGrid::index: share of the pixels that would show a cell's ground
  /// and show something else, which stands there, or before it.
  std::vector<float> hidden_share;
  /// Share of the pixels that would show a cell's ground and show nothing, by PolarGrid::index.
  std::vector<float> unknown_share;
  /// Share of the pixels that would show a cell's ground and look otherwise than it looked before, by
  /// PolarGrid::index; empty where there was nothing to compare with. GroundWatch's, not the detector's.
  std::vector<float> changed_share;
  /// Share of a cell's points that rise above the ground, by PolarGrid::index; NaN without points.
  std::vector<float> occupied_share;
  ObstacleScan scan;  ///< the first obstacle on each ray
};

/// Obstacles in the range maps of one camera: points above the ground are collected in a polar grid and
/// weighed against the evidence for bare ground (paper, section Obstacle Detection; Haene et al., IROS 2015).
///
/// Evidence for bare ground is a measured ground point: it clears the strip before it in which its ray is
/// lower than min_height_m above the ground. Unknown ranges, points beyond and rays that pass higher clear
/// nothing.
///
/// Immutable, and cheap to copy: one object serves any number of threads; the result depends on the range map
/// alone.
class ObstacleDetector {
 public:
  /// std::invalid_argument for bad options, or a camera that is not above the reference height.
  ObstacleDetector(const WorkingCamera& camera, const RigidTransform& vehicle_from_camera,
                   const ObstacleDetectorOptions& options = ObstacleDetectorOptions());

  /// std::logic_error for a range map of another size than the camera's.
  CameraObstacles detect(const RangeMap& map) const;

  const PolarGrid& grid() const;

 private:
  struct Implementation;
  std::shared_ptr<const Implementation> implementation_;
};

}  // namespace vcharge
