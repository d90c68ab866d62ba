#pragma once

#include <optional>
#include <vector>

#include <Eigen/Core>

#include "vcharge_core/base/options.h"
#include "vcharge_geometry/solvers/pluecker_line.h"
#include "vcharge_reconstruction/mapping_data.h"

namespace vcharge {

struct TriangulationOptions {
  double min_parallax_rad = 0.02;  ///< largest angle between two of the rays must be at least this
  double min_range_m = 0.3;
  double max_range_m = 60.0;
  double max_error_rad = 0.004;  ///< of every ray
  int min_observations = 3;

  template <class Visitor>
  void visitFields(Visitor&& visit) {
    visit("min_parallax_rad", min_parallax_rad);
    visit("min_range_m", min_range_m);
    visit("max_range_m", max_range_m);
    visit("max_error_rad", max_error_rad);
    visit("min_observations", min_observations);
  }
  void validate() const;  ///< throws std::invalid_argument naming the field
};

/// The point nearest to rays (unit directions) that lie in one frame, by angle. Empty where the rays are too
/// parallel, meet behind a camera or out of range, or miss the point by too much.
std::optional<Eigen::Vector3d> triangulate(const std::vector<Ray>& rays, const TriangulationOptions& options);

/// The ray of an observation in the map. False where the camera has none there.
bool observationRay(const MappingData& data, const TrackObservation& observation, Ray* ray_in_map);

/// Gives every track with enough observations its position by the keyframes' poses, or none. Data parallel.
void triangulateTracks(const TriangulationOptions& options, MappingData* data);

}  // namespace vcharge
