#pragma once

#include <memory>
#include <optional>
#include <vector>

#include <opencv2/core.hpp>

#include "sweep/sweep_level.h"
#include "vcharge_dense/plane_sweep.h"

namespace vcharge {

/// Whether images of this size are large enough to be swept at half their size.
bool canBeHalved(cv::Size size);

/// The images of a sweep: reference and neighbours.
struct SweepPixels {
  cv::Mat reference;
  std::vector<cv::Mat> neighbours;
};

/// Halves images by averaging blocks of two by two pixels.
SweepPixels halved(const SweepPixels& pixels);

/// Camera of images that were halved by averaging blocks of two by two pixels.
MeiCamera halved(const MeiCamera& camera);

/// Halves a mask: nonzero if all four pixels of a block are.
cv::Mat halvedMask(const cv::Mat& mask);

/// A level for halved images, with other options.
std::unique_ptr<const SweepLevel> halfLevel(const SweepLevel& fine, const PlaneSweepOptions& options,
                                            const std::optional<Plane>& ground_in_camera);

/// Input for a level of half the size, with the poses of `fine`. `half_pixels`: halved images in its order;
/// neighbours without pixels are left out.
SweepInput halfInput(const SweepLevel& half, const SweepInput& fine, const SweepPixels& half_pixels);

}  // namespace vcharge
