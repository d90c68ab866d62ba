#include "vcharge_evaluation/range_evaluator.h"

#include <algorithm>
#include <cmath>

#include <opencv2/imgproc.hpp>

#include "vcharge_core/base/error.h"
#include "vcharge_core/camera/ray_table.h"
#include "vcharge_evaluation/travel_angle.h"

namespace vcharge {
namespace {

constexpr double kFullCircle = 6.283185307179587;
constexpr double kMinTruth_m = 0.5;
// A pixel has texture if the image's standard deviation in this window reaches this number of gray levels.
constexpr int kTextureWindow_px = 7;
constexpr double kMinTexture = 4.0;
constexpr double kMaxRelativeError = 0.5;    // larger errors and unknown ranges count as this
constexpr double kRightRelativeError = 0.1;  // up to which a range counts as right for its confidence

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

double fractionOf(size_t part, size_t whole) {
  return whole > 0 ? static_cast<double>(part) / static_cast<double>(whole) : 0.0;
}

}  // namespace

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
  const cv::Mat texture = localStandardDeviation(image, kTextureWindow_px);
  const float max_cosine = static_cast<float>(std::cos(kMinAngleFromTravel_rad));
  Eigen::Vector3f travel = Eigen::Vector3f::Zero();
  if (travel_direction_in_camera) {
    travel = travel_direction_in_camera->normalized().cast<float>();
  }
  for (int y = 0; y < size.height; y += options_.pixel_step) {
    for (int x = 0; x < size.width; x += options_.pixel_step) {
      const float truth = truth_m.at<float>(y, x);
      if (valid.at<uint8_t>(y, x) == 0 || !(truth >= kMinTruth_m && truth <= options_.max_truth_m) ||
          texture.at<double>(y, x) < kMinTexture || !rays.valid(x, y) ||
          std::abs(rays.ray(x, y).dot(travel)) > max_cosine) {
        continue;
      }
      samples_.push_back({truth, map.range_m.at<float>(y, x), map.standard_deviation_m.at<float>(y, x),
                          map.confidence.at<float>(y, x)});
    }
  }
  ++num_frames_;
}

/// The known ranges of a set of samples.
struct RangeEvaluator::Known {
  double tolerance;
  std::vector<double> relative_errors;
  size_t within_tolerance = 0, within_one_sigma = 0, within_two_sigma = 0;

  void add(const Sample& sample) {
    if (!std::isfinite(sample.range_m)) {
      return;
    }
    const float error_m = std::abs(sample.range_m - sample.truth_m);
    relative_errors.push_back(error_m / static_cast<double>(sample.truth_m));
    within_tolerance += relative_errors.back() <= tolerance ? 1 : 0;
    within_one_sigma += error_m <= sample.sigma_m ? 1 : 0;
    within_two_sigma += error_m <= 2.0F * sample.sigma_m ? 1 : 0;
  }
  size_t count() const { return relative_errors.size(); }
};

RangeBin RangeEvaluator::makeBin(double low, double high, float Sample::*criterion) const {
  Known known{options_.tolerance};
  size_t num_judged = 0;
  for (const Sample& sample : samples_) {
    if (sample.*criterion >= low && sample.*criterion < high) {
      ++num_judged;
      known.add(sample);
    }
  }
  RangeBin bin{low, high, num_judged, known.count()};
  bin.fraction_within_tolerance = fractionOf(known.within_tolerance, known.count());
  bin.fraction_within_one_sigma = fractionOf(known.within_one_sigma, known.count());
  bin.median_relative_error = summarize(std::move(known.relative_errors)).percentile_50;
  return bin;
}

RangeErrors RangeEvaluator::errors() const {
  RangeErrors errors;
  errors.num_frames = num_frames_;
  errors.num_judged = samples_.size();
  // Most confident first and unknown last; a stable sort makes ties deterministic.
  std::vector<Sample> ranked = samples_;
  std::stable_sort(ranked.begin(), ranked.end(), [](const Sample& left, const Sample& right) {
    const bool is_left_known = std::isfinite(left.range_m);
    return is_left_known != std::isfinite(right.range_m) ? is_left_known : left.confidence > right.confidence;
  });
  for (const double density : options_.densities) {
    const auto count = static_cast<size_t>(std::lround(density * static_cast<double>(ranked.size())));
    Known known{options_.tolerance};
    std::for_each_n(ranked.begin(), count, [&](const Sample& sample) { known.add(sample); });
    RangeAccuracy accuracy;
    accuracy.density = density;
    accuracy.fraction_known = fractionOf(known.count(), count);
    accuracy.fraction_within_tolerance = fractionOf(known.within_tolerance, count);
    accuracy.median_relative_error = summarize(std::move(known.relative_errors)).percentile_50;
    errors.accuracy.push_back(accuracy);
  }
  const std::vector<double> edges_m = {0.0, 1.0, 2.0, 4.0, 8.0, 16.0, 32.0, 1e9};
  for (size_t i = 0; i + 1 < edges_m.size(); ++i) {
    errors.by_truth.push_back(makeBin(edges_m[i], edges_m[i + 1], &Sample::truth_m));
  }
  constexpr int kConfidenceBins = 10;
  for (int i = 0; i < kConfidenceBins; ++i) {
    // The last bin includes a confidence of 1.
    const double high = i + 1 == kConfidenceBins ? 1.0 + 1e-6 : static_cast<double>(i + 1) / kConfidenceBins;
    errors.by_confidence.push_back(
        makeBin(static_cast<double>(i) / kConfidenceBins, high, &Sample::confidence));
  }
  Known all{options_.tolerance};
  std::for_each(samples_.begin(), samples_.end(), [&](const Sample& sample) { all.add(sample); });
  errors.num_known = all.count();
  std::vector<double> bounded(samples_.size() - all.count(), kMaxRelativeError);
  ConfidenceCalibration calibration;
  for (const Sample& sample : samples_) {
    if (std::isfinite(sample.range_m)) {
      const double error = std::abs(sample.range_m / static_cast<double>(sample.truth_m) - 1.0);
      bounded.push_back(std::min(error, kMaxRelativeError));
      calibration.add(sample.confidence, error <= kRightRelativeError);
    }
  }
  errors.bounded_relative_error = summarize(std::move(bounded));
  errors.calibration = calibration.bins();
  errors.fraction_within_one_sigma = fractionOf(all.within_one_sigma, all.count());
  errors.fraction_within_two_sigma = fractionOf(all.within_two_sigma, all.count());
  return errors;
}

}  // namespace vcharge
