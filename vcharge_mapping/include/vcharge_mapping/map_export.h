#pragma once

#include <string>
#include <vector>

#include "vcharge_core/camera/equidistant_fit.h"
#include "vcharge_core/motion/trajectory.h"
#include "vcharge_core/sparse_map/sparse_map.h"

namespace vcharge {

/// The poses of the keyframes, map_from_vehicle.
Trajectory trajectoryOf(const SparseMap& map);

/// PLY (ASCII): landmarks as grey vertices; each keyframe as its origin and the tips of its axes (0.5 m),
/// with edges for the axes (x red, y green, z blue) and for the way from keyframe to keyframe (yellow).
/// Replaces the file only once it is complete.
void exportPly(const SparseMap& map, const std::string& path);

/// What exportColmap could not say in COLMAP's terms.
struct ColmapExport {
  std::vector<EquidistantFit> cameras;  ///< of the rig, in its order; COLMAP's centre is half a pixel further
  size_t num_images = 0;                ///< images with observations
  size_t num_points = 0;
  size_t num_observations = 0;
  /// COLMAP's OPENCV_FISHEYE projects nothing 90 degrees or more from the axis: these were left out.
  size_t num_observations_left_out = 0;
  size_t num_points_left_out = 0;
};

/// COLMAP's text model (https://colmap.github.io/format.html): cameras.txt with the OPENCV_FISHEYE closest to
/// each camera and the residual of the fit as a comment, images.txt with camera_from_map and names
/// <camera>/<stamp_ns>.png, points3D.txt with the mean error in pixels by the map's own cameras. COLMAP
/// counts pixels from the corner of the first one: all are half a pixel larger than in the map. InputError
/// for a folder that holds anything else, which would be lost, and for a camera that no OPENCV_FISHEYE comes
/// near.
ColmapExport exportColmap(const SparseMap& map, const std::string& folder);

}  // namespace vcharge
