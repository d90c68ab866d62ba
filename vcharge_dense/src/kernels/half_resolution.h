#pragma once

#include <memory>
#include <optional>
#include <vector>

#include <opencv2/core.hpp>

#include "sweep/sweep_level.h"
#include "vcharge_dense/plane_sweep.h"

namespace vcharge {

/// False for images too small to be swept at half their size.
bool canBeHalved(cv::Size size);

/// What a sweep compares: the reference's image and those of its neighbours.
struct SweepPixels {
  cv::Mat reference;
  std::vector<cv::Mat> neighbours;
};

/// Means of two by two pixels.
SweepPixels halved(const SweepPixels& pixels);

/// Of images whose pixels are means of two by two.
MeiCamera halved(const MeiCamera& camera);

/// Not 0 where all four pixels are valid.
cv::Mat halvedMask(const cv::Mat& mask);

/// A level for images of half the size, whose pixels are valid where all four are that they are the mean of.
std::unique_ptr<const SweepLevel> halfLevel(const SweepLevel& fine, const PlaneSweepOptions& options,
                                            const std::optional<Plane>& ground_in_camera);

/// Input of a level of half the size. half_pixels: neighbours in the order of the fine input's.
SweepInput halfInput(const SweepLevel& half, const SweepInput& fine, const SweepPixels& half_pixels);

}  // namespace vcharge
