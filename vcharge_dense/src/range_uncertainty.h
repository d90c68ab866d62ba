#pragma once

#include <Eigen/Core>
#include <opencv2/core.hpp>

#include "surface_estimate.h"
#include "tile_scorer.h"
#include "vcharge_core/range_map.h"

namespace vcharge {

/// How the image of a point in a neighbour reacts to errors.
struct PixelSensitivity {
  float pixels_per_inverse_range =
      0.0f;  ///< pixels per 1/m along the ray; 0 where the neighbour does not see the point
  float pixels_per_radian = 0.0f;  ///< along that same direction, of a rotation of the neighbour (worst axis)
  float range_ratio = 1.0f;        ///< range from the neighbour over range from the reference
};

/// Of the point on the unit `ray` at `inverse_range` (per metre), by the unified projection's derivative.
PixelSensitivity pixelSensitivity(const MeiCamera& camera, const SweepNeighbour& neighbour,
                                  const Eigen::Vector3f& ray, float inverse_range);

/// Range, standard deviation and confidence from what the sweep found; applies the options' gates. The
/// confidence is the probability that the range is within 5 %, as calibrated on simulated drives.
///
/// The variance in inverse range has four parts: image noise, from the height and the curvature of the
/// score's peak (a peak of height 1 - e leaves noise e times the window's contrast, and the curvature says
/// how fast the windows disagree); matching_noise_px over the motion of the neighbours' pixels, which does
/// not average out; the relative poses' errors, taken as common to all neighbours; and how rough the
/// neighbouring estimates are: at edges and on slanted surfaces windows do not fit, and estimates scatter
/// more than noise makes them. Where the point hardly moves in the image (towards the direction of travel)
/// all of them grow without bound.
void estimateRange(const SweepInput& input, const SurfaceEstimate& estimate, RangeMap* map);

}  // namespace vcharge
