#pragma once

#include <optional>
#include <vector>

#include <Eigen/Core>

#include "vcharge_core/base/options.h"
#include "vcharge_geometry/solvers/pluecker_line.h"
#include "vcharge_reconstruction/reconstruction_data.h"

namespace vcharge {

struct TriangulationOptions {
  VCHARGE_BEGIN_OPTIONS(TriangulationOptions);
  VCHARGE_OPTION(double, min_parallax_rad, 0.02, positive(), "Least angle between two rays of a point.");
  VCHARGE_OPTION(double, max_range_m, 60.0, above(0.3), "Largest distance of a point from a camera.");
  VCHARGE_OPTION(double, max_error_rad, 0.004, positive(), "Largest angle between a ray and its point.");
  VCHARGE_END_OPTIONS();
};

/// The point nearest to rays (unit directions) of one frame. nullopt if the rays are too parallel, meet
/// behind a camera or out of range, or miss the point by too much.
std::optional<Eigen::Vector3d> triangulate(const std::vector<Ray>& rays, const TriangulationOptions& options);

/// The ray of an observation in the map. False if the camera has no ray at that pixel.
bool observationRay(const ReconstructionData& data, const TrackObservation& observation, Ray* ray_in_map);

/// Triangulates every track from the poses of the keyframes; a track loses its position if this fails. Data
/// parallel.
void triangulateTracks(const TriangulationOptions& options, ReconstructionData* data);

}  // namespace vcharge
