#include "surround_view/seam_weights.h"

#include <algorithm>
#include <cmath>

#include <opencv2/imgproc.hpp>

#include "kernels/parallel_rows.h"

namespace vcharge {
namespace {

constexpr double kSeam_m =
    0.5;  // over a wider seam, images that do not lie exactly on one another are blurred
constexpr double kFade_m = 0.3;  // width of the rim in which a camera fades out
constexpr double kAlone = 0.02;  // a smaller part of a pixel is left to the other camera

/// Distance of each pixel of the view to the rim of what a camera sees, up to kFade_m, over kFade_m.
cv::Mat fading(const ViewGrid& grid, const GroundProjection& projection) {
  cv::Mat is_seen(grid.size(), CV_8UC1);
  for (size_t i = 0; i < is_seen.total(); ++i) {
    is_seen.data[i] = std::isfinite(projection.sigma_m[i]) ? 1 : 0;
  }
  cv::Mat distance_px;
  cv::distanceTransform(is_seen, distance_px, cv::DIST_L2, 3, CV_32F);
  return cv::min(distance_px * (grid.pixel_m() / kFade_m), 1.0);
}

/// Per camera, the part of each pixel (CV_32FC1) that it shows; their sum may be below 1. Empty for cameras
/// that are not in use.
std::vector<cv::Mat> partsOf(const ViewGrid& grid, const std::vector<GroundProjection>& projections) {
  std::vector<cv::Mat> parts(projections.size());
  for (size_t camera = 0; camera < projections.size(); ++camera) {
    if (!projections[camera].sigma_m.empty()) {
      parts[camera] = cv::Mat::zeros(grid.size(), CV_32FC1);
    }
  }
  for (int i = 0; i < grid.size().area(); ++i) {
    size_t best = projections.size();
    float best_m = std::numeric_limits<float>::infinity();
    for (size_t camera = 0; camera < projections.size(); ++camera) {
      if (!parts[camera].empty() && projections[camera].sigma_m[static_cast<size_t>(i)] < best_m) {
        best = camera;
        best_m = projections[camera].sigma_m[static_cast<size_t>(i)];
      }
    }
    if (best < projections.size()) {
      parts[best].ptr<float>()[i] = 1.0F;
    }
  }
  const int width_px = 2 * static_cast<int>(std::lround(0.5 * kSeam_m / grid.pixel_m())) + 1;
  for (size_t camera = 0; camera < projections.size(); ++camera) {
    if (!parts[camera].empty()) {
      cv::blur(parts[camera], parts[camera], {width_px, width_px});
      parts[camera] = parts[camera].mul(fading(grid, projections[camera]));
    }
  }
  return parts;
}

struct Candidate {
  uint8_t camera = kNoCamera;
  float part = 0.0F;
  float sigma_m = std::numeric_limits<float>::infinity();

  bool isBefore(const Candidate& other) const {
    return part > other.part || (part == other.part && sigma_m < other.sigma_m);
  }
};

}  // namespace

ViewLayers weightCameras(const ViewGrid& grid, const std::vector<GroundProjection>& projections) {
  const std::vector<cv::Mat> parts = partsOf(grid, projections);
  const auto num_pixels = static_cast<size_t>(grid.size().area());
  ViewLayers layers{std::vector<ViewSample>(num_pixels), std::vector<ViewSample>(num_pixels),
                    std::vector<float>(num_pixels, 0.0F)};
  forEachRow(grid.size().height, [&](int row) {
    for (int column = 0; column < grid.size().width; ++column) {
      const size_t i = static_cast<size_t>(row) * grid.size().width + column;
      Candidate first, second;
      for (size_t camera = 0; camera < projections.size(); ++camera) {
        if (parts[camera].empty() || !std::isfinite(projections[camera].sigma_m[i])) {
          continue;
        }
        const Candidate candidate{static_cast<uint8_t>(camera), parts[camera].at<float>(row, column),
                                  projections[camera].sigma_m[i]};
        if (candidate.isBefore(first)) {
          second = first;
          first = candidate;
        } else if (candidate.isBefore(second)) {
          second = candidate;
        }
      }
      if (first.camera == kNoCamera) {
        continue;
      }
      const float sum = first.part + second.part;
      const float part = sum > 0.0F ? second.part / sum : 0.0F;
      const auto weight = static_cast<uint8_t>(part < kAlone ? 0 : std::lround(255.0F * part));
      const auto sampleOf = [&](const Candidate& candidate, int its_weight) {
        const GroundProjection& projection = projections[candidate.camera];
        return ViewSample{projection.positions[i], candidate.camera, static_cast<uint8_t>(its_weight),
                          projection.angles[i]};
      };
      layers.first[i] = sampleOf(first, 255 - weight);
      if (second.camera != kNoCamera) {
        layers.second[i] = sampleOf(second, weight);
        layers.sigma_ratio[i] = second.sigma_m / first.sigma_m;
      }
    }
  });
  return layers;
}

}  // namespace vcharge
