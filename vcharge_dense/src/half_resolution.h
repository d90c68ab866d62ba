#pragma once

#include <memory>
#include <optional>
#include <vector>

#include <opencv2/core.hpp>

#include "sweep_level.h"
#include "vcharge_dense/plane_sweep.h"

namespace vcharge {

/// False for images too small to be swept at half their size.
bool canBeHalved(cv::Size size);

/// A level for images of half the size, whose pixels are means of two by two and valid where all of them are.
std::unique_ptr<const SweepLevel> halfLevel(const SweepLevel& fine, const PlaneSweepOptions& options,
                                            const std::optional<Plane>& ground_in_camera);

/// Input of a level of half the size. neighbours: in the order of the fine input's.
SweepInput halfInput(const SweepLevel& half, const SweepInput& fine, const cv::Mat& reference_pixels,
                     const std::vector<SweepImage>& neighbours);

}  // namespace vcharge
