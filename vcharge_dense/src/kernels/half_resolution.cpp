#include "kernels/half_resolution.h"

#include <optional>
#include <utility>

#include <tbb/parallel_for.h>
#include <opencv2/imgproc.hpp>

namespace vcharge {
namespace {

constexpr int kMinWidth_px = 16;  // largest number of lanes of a vector

cv::Size halfSize(cv::Size size) {
  return {size.width / 2, size.height / 2};
}

cv::Mat halved(const cv::Mat& image) {
  const cv::Size size = halfSize(image.size());
  cv::Mat half;
  cv::resize(image(cv::Rect(0, 0, 2 * size.width, 2 * size.height)), half, size, 0.0, 0.0, cv::INTER_AREA);
  return half;
}

}  // namespace

SweepPixels halved(const SweepPixels& pixels) {
  SweepPixels half{halved(pixels.reference), std::vector<cv::Mat>(pixels.neighbours.size())};
  tbb::parallel_for(size_t{0}, half.neighbours.size(),
                    [&](size_t n) { half.neighbours[n] = halved(pixels.neighbours[n]); });
  return half;
}

cv::Mat halvedMask(const cv::Mat& mask) {
  cv::Mat half(halfSize(mask.size()), CV_8UC1);
  for (int y = 0; y < half.rows; ++y) {
    const auto* above = mask.ptr<uint8_t>(2 * y);
    const auto* below = mask.ptr<uint8_t>(2 * y + 1);
    for (int x = 0; x < half.cols; ++x) {
      const bool valid =
          above[2 * x] != 0 && above[2 * x + 1] != 0 && below[2 * x] != 0 && below[2 * x + 1] != 0;
      half.at<uint8_t>(y, x) = valid ? 255 : 0;
    }
  }
  return half;
}

MeiCamera halved(const MeiCamera& camera) {
  return MeiCamera(camera.xi(), 0.5 * camera.gamma1(), 0.5 * camera.gamma2(), 0.5 * camera.u0() - 0.25,
                   0.5 * camera.v0() - 0.25);
}

bool canBeHalved(cv::Size size) {
  return halfSize(size).width >= kMinWidth_px && halfSize(size).height > 0;
}

std::unique_ptr<const SweepLevel> halfLevel(const SweepLevel& fine, const PlaneSweepOptions& options,
                                            const std::optional<Plane>& ground_in_camera) {
  return std::make_unique<SweepLevel>(halved(fine.camera()), halvedMask(fine.validMask()), options,
                                      ground_in_camera, fine.axes());
}

SweepInput halfInput(const SweepLevel& half, const SweepInput& fine, const SweepPixels& half_pixels) {
  SweepInput input = half.makeInput(half_pixels.reference);
  std::vector<std::optional<SweepNeighbour>> halves(half_pixels.neighbours.size());
  tbb::parallel_for(size_t{0}, halves.size(), [&](size_t n) {
    if (half_pixels.neighbours[n].empty()) {
      return;
    }
    const SweepNeighbour& from = fine.neighbours[n];
    const cv::Mat other_mask = from.other_mask.empty() ? cv::Mat() : halvedMask(from.other_mask);
    halves[n].emplace(SweepNeighbour{
        PackedImage(half_pixels.neighbours[n], other_mask.empty() ? half.validMask() : other_mask),
        halved(from.camera), from.neighbour_from_reference, from.translation_m, from.after, from.noise,
        other_mask, from.exposure, from.reference_exposure, from.reference_xi});
  });
  for (std::optional<SweepNeighbour>& neighbour : halves) {
    if (neighbour) {
      input.neighbours.push_back(std::move(*neighbour));
    }
  }
  return input;
}

}  // namespace vcharge
