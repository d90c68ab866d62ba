#include "vcharge_evaluation/range_evaluator.h"

#include <algorithm>
#include <cmath>

#include <opencv2/imgproc.hpp>

#include "vcharge_core/base/error.h"
#include "vcharge_core/base/options.h"
#include "vcharge_core/camera/ray_table.h"

namespace vcharge {
namespace {

constexpr double kFullCircle = 6.283185307179587;

/// Standard deviation of the image in a square window around each pixel, in gray levels.
cv::Mat localStandardDeviation(const cv::Mat& image, int window_px) {
  cv::Mat values, mean, mean_of_squares;
  image.convertTo(values, CV_64F);
  cv::boxFilter(values, mean, CV_64F, cv::Size(window_px, window_px));
  cv::sqrBoxFilter(values, mean_of_squares, CV_64F, cv::Size(window_px, window_px));
  cv::Mat variance = cv::max(mean_of_squares - mean.mul(mean), 0.0);
  cv::sqrt(variance, variance);
  return variance;
}

}  // namespace

void RangeEvaluationOptions::validate() const {
  requireField(pixel_step >= 1, "pixel_step", "must be at least 1", pixel_step);
  requireField(texture_window_px >= 1 && texture_window_px % 2 == 1, "texture_window_px",
               "must be odd and positive", texture_window_px);
  requireField(min_texture_gray >= 0.0, "min_texture_gray", "must be at least 0", min_texture_gray);
  requireField(min_truth_m >= 0.0, "min_truth_m", "must be at least 0", min_truth_m);
  requireField(max_truth_m > min_truth_m, "max_truth_m", "must exceed min_truth_m", max_truth_m);
  requireField(min_angle_from_travel_rad >= 0.0 && min_angle_from_travel_rad < 0.25 * kFullCircle,
               "min_angle_from_travel_rad", "must be in [0, pi/2)", min_angle_from_travel_rad);
  requireField(tolerance > 0.0, "tolerance", "must be positive", tolerance);
  for (const double density : densities) {
    requireField(density > 0.0 && density <= 1.0, "densities", "must be in (0, 1]", density);
  }
}

RangeEvaluator::RangeEvaluator(const RangeEvaluationOptions& options) : options_(options) {
  options_.validate();
}

void RangeEvaluator::add(const RangeMap& map, const cv::Mat& image, const cv::Mat& truth_m,
                         const cv::Mat& valid,
                         const std::optional<Eigen::Vector3d>& travel_direction_in_camera) {
  const cv::Size size = map.range_m.size();
  check(image.type() == CV_8UC1 && truth_m.type() == CV_32FC1 && valid.type() == CV_8UC1,
        "RangeEvaluator::add: expected CV_8UC1, CV_32FC1 and CV_8UC1");
  check(image.size() == size && truth_m.size() == size && valid.size() == size,
        "RangeEvaluator::add: expected images of the range map's size");
  const RayTable rays(map.camera, size, kFullCircle);
  const cv::Mat texture = localStandardDeviation(image, options_.texture_window_px);
  const float max_cosine = static_cast<float>(std::cos(options_.min_angle_from_travel_rad));
  Eigen::Vector3f travel = Eigen::Vector3f::Zero();
  if (travel_direction_in_camera) {
    travel = travel_direction_in_camera->normalized().cast<float>();
  }
  for (int y = 0; y < size.height; y += options_.pixel_step) {
    for (int x = 0; x < size.width; x += options_.pixel_step) {
      const float truth = truth_m.at<float>(y, x);
      if (valid.at<uint8_t>(y, x) == 0 || !(truth >= options_.min_truth_m && truth <= options_.max_truth_m) ||
          texture.at<double>(y, x) < options_.min_texture_gray || !rays.valid(x, y) ||
          std::abs(rays.ray(x, y).dot(travel)) > max_cosine) {
        continue;
      }
      samples_.push_back({truth, map.range_m.at<float>(y, x), map.standard_deviation_m.at<float>(y, x),
                          map.confidence.at<float>(y, x)});
    }
  }
  ++num_frames_;
}

RangeErrors RangeEvaluator::errors() const {
  RangeErrors errors;
  errors.num_frames = num_frames_;
  errors.num_judged = samples_.size();
  const auto isKnown = [](const Sample& sample) { return std::isfinite(sample.range_m); };
  const auto relativeError = [](const Sample& sample) {
    return std::abs(sample.range_m - sample.truth_m) / static_cast<double>(sample.truth_m);
  };

  // Most confident first, unknown last; stable, so that ties keep the order of the pixels.
  std::vector<Sample> ranked = samples_;
  std::stable_sort(ranked.begin(), ranked.end(), [&](const Sample& left, const Sample& right) {
    return isKnown(left) != isKnown(right) ? isKnown(left) : left.confidence > right.confidence;
  });
  for (const double density : options_.densities) {
    const auto count = static_cast<size_t>(std::lround(density * static_cast<double>(ranked.size())));
    RangeAccuracy accuracy;
    accuracy.density = density;
    std::vector<double> known_errors;
    uint64_t within = 0;
    for (size_t i = 0; i < count; ++i) {
      if (isKnown(ranked[i])) {
        known_errors.push_back(relativeError(ranked[i]));
        within += known_errors.back() <= options_.tolerance ? 1 : 0;
      }
    }
    if (count > 0) {
      accuracy.share_known = static_cast<double>(known_errors.size()) / static_cast<double>(count);
      accuracy.share_within_tolerance = static_cast<double>(within) / static_cast<double>(count);
    }
    accuracy.median_relative_error = summarize(std::move(known_errors)).percentile_50;
    errors.accuracy.push_back(accuracy);
  }

  const auto makeBin = [&](double low, double high, const auto& criterion) {
    RangeBin bin{low, high};
    std::vector<double> known_errors;
    uint64_t within = 0;
    uint64_t within_sigma = 0;
    for (const Sample& sample : samples_) {
      if (isKnown(sample) && criterion(sample) >= low && criterion(sample) < high) {
        known_errors.push_back(relativeError(sample));
        within += known_errors.back() <= options_.tolerance ? 1 : 0;
        within_sigma += std::abs(sample.range_m - sample.truth_m) <= sample.sigma_m ? 1 : 0;
      }
    }
    bin.count = known_errors.size();
    if (bin.count > 0) {
      bin.share_within_tolerance = static_cast<double>(within) / static_cast<double>(bin.count);
      bin.share_within_one_sigma = static_cast<double>(within_sigma) / static_cast<double>(bin.count);
    }
    bin.median_relative_error = summarize(std::move(known_errors)).percentile_50;
    return bin;
  };
  const auto truthOf = [](const Sample& sample) { return static_cast<double>(sample.truth_m); };
  const auto confidenceOf = [](const Sample& sample) { return static_cast<double>(sample.confidence); };
  const std::vector<double> edges_m = {0.0, 1.0, 2.0, 4.0, 8.0, 16.0, 32.0, 1e9};
  for (size_t i = 0; i + 1 < edges_m.size(); ++i) {
    errors.by_truth.push_back(makeBin(edges_m[i], edges_m[i + 1], truthOf));
  }
  constexpr int kConfidenceBins = 10;
  for (int i = 0; i < kConfidenceBins; ++i) {
    // The last bin includes a confidence of 1.
    const double high = i + 1 == kConfidenceBins ? 1.0 + 1e-6 : static_cast<double>(i + 1) / kConfidenceBins;
    errors.by_confidence.push_back(makeBin(static_cast<double>(i) / kConfidenceBins, high, confidenceOf));
  }

  uint64_t within_one = 0;
  uint64_t within_two = 0;
  for (const Sample& sample : samples_) {
    if (isKnown(sample)) {
      ++errors.num_known;
      const float error = std::abs(sample.range_m - sample.truth_m);
      within_one += error <= sample.sigma_m ? 1 : 0;
      within_two += error <= 2.0F * sample.sigma_m ? 1 : 0;
    }
  }
  if (errors.num_known > 0) {
    errors.share_within_one_sigma = static_cast<double>(within_one) / static_cast<double>(errors.num_known);
    errors.share_within_two_sigma = static_cast<double>(within_two) / static_cast<double>(errors.num_known);
  }
  return errors;
}

}  // namespace vcharge
