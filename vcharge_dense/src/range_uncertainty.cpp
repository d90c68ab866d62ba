#include "range_uncertainty.h"

#include <algorithm>
#include <cmath>
#include <limits>

#include <tbb/blocked_range.h>
#include <tbb/parallel_for.h>

namespace vcharge {
namespace {

constexpr float kNaN = std::numeric_limits<float>::quiet_NaN();

// Noise of a window that the score leaves unexplained, against what its curvature says about one pixel: the
// samples of a window are interpolated, hence not independent.
constexpr float kImageNoiseFactor = 2.0f;

float square(float value) {
  return value * value;
}

/// Variance of the inverse range at one pixel.
float inverseRangeVariance(const SweepInput& input, const SurfaceEstimate& estimate, int x, int y) {
  const PlaneSweepOptions& options = *input.options;
  const float inverse_range = estimate.inverse_range.at<float>(y, x);
  const auto voters = static_cast<uint32_t>(estimate.voters.at<int>(y, x));
  // A random walk errs alike for all neighbours on one side of the reference, and independently on the other
  // side.
  float motion_squares = 0.0f, errors_before = 0.0f, errors_after = 0.0f, matching_errors = 0.0f;
  int count = 0;
  for (size_t n = 0; n < input.neighbours.size(); ++n) {
    if ((voters & (1u << n)) == 0) {
      continue;
    }
    const SweepNeighbour& neighbour = input.neighbours[n];
    const PixelSensitivity sensitivity =
        pixelSensitivity(input.camera, neighbour, input.rays->ray(x, y), inverse_range);
    const float baseline_m = neighbour.translation_m.norm();
    const auto variance = [baseline_m](double of_any_pair, double per_sqrt_m) {
      return static_cast<float>(of_any_pair * of_any_pair + per_sqrt_m * per_sqrt_m * baseline_m);
    };
    const PoseNoiseOptions& pose = options.pose_noise;
    const float rotation_variance = variance(pose.rotation_rad, pose.rotation_rad_per_sqrt_m);
    const float translation_variance = variance(pose.translation_m, pose.translation_m_per_sqrt_m);
    const float pixel_error =
        sensitivity.pixels_per_radian *
        std::sqrt(rotation_variance + translation_variance * square(inverse_range / sensitivity.range_ratio));
    // Windows seen at another scale differ by more than a shift.
    const float scale = std::max(sensitivity.range_ratio, 1.0f / sensitivity.range_ratio);
    matching_errors += square(sensitivity.pixels_per_inverse_range *
                              static_cast<float>(options.matching_noise_px) * scale * scale);
    motion_squares += square(sensitivity.pixels_per_inverse_range);
    (neighbour.after ? errors_after : errors_before) += sensitivity.pixels_per_inverse_range * pixel_error;
    ++count;
  }
  if (count == 0 || !(motion_squares > 0.0f)) {
    return std::numeric_limits<float>::infinity();
  }
  const float score = estimate.score.at<float>(y, x);
  const float curvature = estimate.curvature.at<float>(y, x);
  const float window = static_cast<float>(options.window_px * options.window_px);
  const float noise = kImageNoiseFactor * std::max(1.0f - score, 1e-3f) / (window * curvature);
  const float matching = static_cast<float>(count) * matching_errors / square(motion_squares);
  const float pose = (square(errors_before) + square(errors_after)) / square(motion_squares) +
                     square(static_cast<float>(options.pose_noise.scale) * inverse_range);
  return std::isnan(noise) ? std::numeric_limits<float>::infinity() : noise + matching + pose;
}

/// Confidence before the neighbourhood is looked at.
float pixelConfidence(const SweepInput& input, const SurfaceEstimate& estimate, int x, int y,
                      float relative_sigma) {
  const PlaneSweepOptions& options = *input.options;
  const float score = estimate.score.at<float>(y, x);
  const auto min_score = static_cast<float>(options.min_score);
  const float height = std::clamp((score - min_score) / (1.0f - min_score), 0.0f, 1.0f);
  const float lead =
      std::clamp((score - std::max(estimate.second_score.at<float>(y, x), 0.0f)) / 0.3f, 0.0f, 1.0f);
  const float precision = 1.0f / (1.0f + square(relative_sigma / 0.05f));
  return height * (0.2f + 0.8f * lead) * precision;
}

/// Share of the neighbouring pixels that found the same surface.
float neighbourhoodSupport(const cv::Mat& inverse_range, const cv::Mat& sigma, int x, int y) {
  constexpr int kRadius = 3;
  const float middle = inverse_range.at<float>(y, x);
  int agree = 0, all = 0;
  for (int v = std::max(0, y - kRadius); v <= std::min(inverse_range.rows - 1, y + kRadius); ++v) {
    for (int u = std::max(0, x - kRadius); u <= std::min(inverse_range.cols - 1, x + kRadius); ++u) {
      const float tolerance = 2.0f * sigma.at<float>(y, x) + 0.03f * middle;
      agree += std::abs(inverse_range.at<float>(v, u) - middle) <= tolerance ? 1 : 0;  // false for NaN
      ++all;
    }
  }
  return static_cast<float>(agree) / static_cast<float>(all);
}

template <class Function>
void forEachRow(int rows, const Function& function) {
  tbb::parallel_for(tbb::blocked_range<int>(0, rows, 16), [&](const tbb::blocked_range<int>& range) {
    for (int y = range.begin(); y < range.end(); ++y) {
      function(y);
    }
  });
}

}  // namespace

PixelSensitivity pixelSensitivity(const MeiCamera& camera, const SweepNeighbour& neighbour,
                                  const Eigen::Vector3f& ray, float inverse_range) {
  PixelSensitivity result;
  const Eigen::Vector3f point =
      neighbour.neighbour_from_reference * ray + inverse_range * neighbour.translation_m;
  const float norm = point.norm();
  const auto xi = static_cast<float>(camera.xi());
  const float denominator = point.z() / norm + xi;
  if (!(norm > 1e-6f) || !(point.z() > norm * (xi > 1.0f ? -1.0f / xi : -xi)) || !(denominator > 1e-6f)) {
    return result;
  }
  const Eigen::Vector3f direction = point / norm;
  const Eigen::Vector2f plane(direction.x() / denominator, direction.y() / denominator);
  const Eigen::Vector2f gamma(static_cast<float>(camera.gamma1()), static_cast<float>(camera.gamma2()));
  // Pixel by direction on the sphere.
  const auto pixelMotion = [&](const Eigen::Vector3f& d) {
    return Eigen::Vector2f(gamma.x() * (d.x() - plane.x() * d.z()) / denominator,
                           gamma.y() * (d.y() - plane.y() * d.z()) / denominator);
  };
  const Eigen::Vector3f& t = neighbour.translation_m;
  const Eigen::Vector2f motion = pixelMotion((t - direction * direction.dot(t)) / norm);
  result.pixels_per_inverse_range = motion.norm();
  result.range_ratio = norm;
  const Eigen::Vector2f along = motion / std::max(result.pixels_per_inverse_range, 1e-9f);
  Eigen::Vector3f row(gamma.x() * along.x(), gamma.y() * along.y(),
                      -gamma.x() * along.x() * plane.x() - gamma.y() * along.y() * plane.y());
  row /= denominator;
  result.pixels_per_radian = (row - direction * direction.dot(row)).norm();
  return result;
}

void estimateRange(const SweepInput& input, const SurfaceEstimate& estimate, RangeMap* map) {
  const PlaneSweepOptions& options = *input.options;
  const cv::Size size = estimate.score.size();
  map->range_m = cv::Mat(size, CV_32FC1, cv::Scalar(kNaN));
  map->standard_deviation_m = cv::Mat(size, CV_32FC1, cv::Scalar(kNaN));
  map->confidence = cv::Mat(size, CV_32FC1, cv::Scalar(0.0f));
  cv::Mat sigma(size, CV_32FC1, cv::Scalar(kNaN));
  forEachRow(size.height, [&](int y) {
    for (int x = 0; x < size.width; ++x) {
      const float inverse_range = estimate.inverse_range.at<float>(y, x);
      if (inverse_range > 0.0f) {
        sigma.at<float>(y, x) = std::sqrt(inverseRangeVariance(input, estimate, x, y));
      }
    }
  });
  forEachRow(size.height, [&](int y) {
    for (int x = 0; x < size.width; ++x) {
      const float inverse_range = estimate.inverse_range.at<float>(y, x);
      if (!(inverse_range > 0.0f)) {
        continue;
      }
      const float relative_sigma = sigma.at<float>(y, x) / inverse_range;
      const float confidence = pixelConfidence(input, estimate, x, y, relative_sigma) *
                               neighbourhoodSupport(estimate.inverse_range, sigma, x, y);
      const bool accepted = estimate.at_limit.at<uint8_t>(y, x) == 0 &&
                            estimate.score.at<float>(y, x) >= static_cast<float>(options.min_score) &&
                            relative_sigma <= static_cast<float>(options.max_relative_sigma) &&
                            confidence >= static_cast<float>(options.min_confidence);
      if (options.gate && !accepted) {
        continue;
      }
      map->range_m.at<float>(y, x) = 1.0f / inverse_range;
      map->standard_deviation_m.at<float>(y, x) = relative_sigma / inverse_range;
      map->confidence.at<float>(y, x) = confidence;
    }
  });
}

}  // namespace vcharge
