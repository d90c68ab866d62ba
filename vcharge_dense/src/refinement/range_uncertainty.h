#pragma once

#include <vector>

#include <opencv2/core.hpp>

#include "refinement/surface_estimate.h"
#include "sweep/tile_scorer.h"
#include "vcharge_core/dense_maps/range_map.h"

namespace vcharge {

/// The neighbours with the errors of their poses that the options expect.
std::vector<NeighbourUncertainty> neighbourUncertainties(const SweepInput& input);

/// Row y of `inverse_range` (CV_32FC1) and of the rays for the kernels.
UncertaintyRow uncertaintyRow(const SweepInput& input, const std::vector<NeighbourUncertainty>& neighbours,
                              const cv::Mat& inverse_range, int y);

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
