#pragma once

#include <vector>

#include <opencv2/core.hpp>

#include "refinement/surface_estimate.h"
#include "sweep/tile_scorer.h"
#include "vcharge_core/dense_maps/range_map.h"

namespace vcharge {

/// The neighbours' projections with the variances of their relative poses.
std::vector<NeighbourUncertainty> neighbourUncertainties(const SweepInput& input);

/// Kernel input for row y of `inverse_range` (CV_32FC1).
UncertaintyRow uncertaintyRow(const SweepInput& input, const std::vector<NeighbourUncertainty>& neighbours,
                              const cv::Mat& inverse_range, int y);

/// Computes range, standard deviation and confidence from the sweep's estimate; uncertain ranges become
/// unknown. The confidence is the probability that the range is within 5 % of the truth, calibrated on
/// simulated drives.
///
/// The variance of the inverse range has four parts: image noise, from the height and curvature of the
/// score's peak (a peak of height 1 - e leaves noise of e times the window's contrast, and the curvature says
/// how fast windows disagree); matching noise over the motion of the neighbours' pixels, which does not
/// average out; the errors of the relative poses, taken as common to all neighbours; and the roughness of
/// neighbouring estimates, which scatter more than noise explains at edges and on slanted surfaces. All parts
/// grow without bound where points hardly move in the image, towards the direction of travel.
void estimateRange(const SweepInput& input, const SurfaceEstimate& estimate, RangeMap* map);

}  // namespace vcharge
