#pragma once

#include <memory>
#include <string>
#include <vector>

#include <Eigen/Core>

#include "vcharge_core/base/options.h"
#include "vcharge_core/camera/working_camera.h"
#include "vcharge_core/dense_maps/obstacle_map.h"
#include "vcharge_core/dense_maps/range_map.h"
#include "vcharge_core/motion/vehicle_footprint.h"
#include "vcharge_obstacles/ground_plane.h"
#include "vcharge_obstacles/polar_grid.h"

namespace vcharge {

/// Height of the reference obstacle, with which the number of points in a cell is compared.
constexpr double kReferenceHeight_m = 0.2;

/// Options of ObstacleDetector. Heights are above the ground.
struct ObstacleDetectorOptions {
  VCHARGE_BEGIN_OPTIONS(ObstacleDetectorOptions);
  VCHARGE_OPTION_GROUP(PolarGridOptions, grid, {}, "Cells in which points are collected.");
  VCHARGE_OPTION_GROUP(GroundPlaneOptions, ground, {}, "The ground plane of a range map.");
  VCHARGE_OPTION(double, min_height_m, 0.08, above(0.0).below(kReferenceHeight_m),
                 "Height up to which a point is ground.");
  VCHARGE_OPTION(double, max_height_m, 1.8, above(kReferenceHeight_m),
                 "Measured height above which the vehicle passes below an obstacle: its own and a margin, as "
                 "heights over 5 m away may be 0.2 m wrong.");
  VCHARGE_OPTION(double, min_confidence, 0.4, atLeast(0.0).below(1.0), "Least confidence of a range used.");
  VCHARGE_OPTION(double, min_support, 0.3, above(0.0).upTo(0.5),
                 "Points that make an obstacle, as a fraction of those of one 0.2 m high.");
  VCHARGE_OPTION(double, max_off_axis_rad, 1.1, positive(),
                 "Horizontal angle from the optical axis beyond which distant points mark no obstacle.");
  VCHARGE_END_OPTIONS();
};

/// An obstacle on the ground, or hanging low above it, in one sector of a camera.
struct PolarObstacle {
  int ray = 0;
  double range_m = 0.0;  ///< horizontal range from the camera; refined by the points in the cell
  double range_sigma_m = 0.0;
  double height_m = 0.0;  ///< height of the highest observed part
  double height_sigma_m = 0.0;
  double bottom_m = 0.0;     ///< height of the lowest observed part
  bool is_off_axis = false;  ///< beyond max_off_axis_rad and kMaxOffAxisRange_m
  bool is_ramp = false;      ///< ranges rise without a gap to a higher obstacle: probably interpolated
  double support = 0.0;      ///< number of points relative to the reference obstacle, at most 1
  double weight = 1.0;       ///< weight of this observation in the map
};

/// Obstacles and ground from one range map. Vectors of floats are indexed by PolarGrid::index; their
/// fractions refer to the pixels that would show the ground of a cell.
struct CameraObstacles {
  Timestamp stamp;
  std::string camera_name;
  Eigen::Vector2d origin_m{0.0, 0.0};  ///< position of the camera in the vehicle frame
  double camera_height_m = 0.0;
  GroundPlane ground;
  double known_fraction = 0.0;           ///< fraction of the camera's valid pixels that have a range
  std::vector<PolarObstacle> obstacles;  ///< sorted by ray, then by range
  /// Range per ray up to which bare ground makes a cell free; empty: no limit. Beyond this range (too far off
  /// the axis), bare ground only confirms free cells and weakens occupied ones.
  std::vector<double> free_to_m;
  /// Range per ray from which no ground is bare, as a body above it would lie outside the image; empty: none.
  std::vector<double> overhung_from_m;
  std::vector<float> free_fraction;     ///< pixels that show bare ground
  std::vector<float> hidden_fraction;   ///< pixels that show something on or in front of the ground
  std::vector<float> unknown_fraction;  ///< pixels without a range
  /// Number of pixels that would show the ground of a cell, by which fractions of several cells are averaged;
  /// empty: the same number for all.
  std::vector<float> expected_ground;
  /// Pixels that differ from an earlier image, from GroundWatch; empty if there was no earlier image.
  std::vector<float> changed_fraction;
  ObstacleScan scan;  ///< first obstacle on each ray
};

/// Finds obstacles in the range maps of one camera: points above the ground are collected in a polar grid and
/// weighed against the evidence for bare ground (paper, section Obstacle Detection; Haene et al., IROS 2015).
///
/// A measured ground point clears the strip in front of it where its ray is lower than min_height_m above
/// the ground. Unknown ranges, points beyond the grid and rays that pass higher clear nothing.
///
/// Immutable and cheap to copy; one object may be used by any number of threads.
class ObstacleDetector {
 public:
  /// Beyond this range, obstacles off the optical axis hide ground but mark no cells of the map: there the
  /// lens resolves little, and another camera observes them better.
  static constexpr double kMaxOffAxisRange_m = 2.5;
  /// Beyond this range, ground off the optical axis does not free cells, because a dark flank may be matched
  /// as ground there.
  static constexpr double kMaxOffAxisFree_m = 1.5;

  /// Points inside the vehicle's outline are not used. std::invalid_argument for bad options, or a camera
  /// that is not above the reference height.
  ObstacleDetector(const WorkingCamera& camera, const RigidTransform& vehicle_from_camera,
                   const VehicleOutline& vehicle,
                   const ObstacleDetectorOptions& options = ObstacleDetectorOptions());

  /// std::logic_error for a range map of another size than the camera's.
  CameraObstacles detect(const RangeMap& map) const;

 private:
  struct Implementation;
  std::shared_ptr<const Implementation> implementation_;
};

}  // namespace vcharge
