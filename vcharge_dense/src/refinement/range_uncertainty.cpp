#include "refinement/range_uncertainty.h"

#include <algorithm>
#include <cmath>
#include <iterator>
#include <limits>
#include <vector>

#include "kernels/parallel_rows.h"
#include "kernels/pooled_mat.h"
#include "vcharge_core/base/wide_loops.h"

namespace vcharge {
namespace {

constexpr float kNaN = std::numeric_limits<float>::quiet_NaN();

// Ratio of the image noise to that of independent samples: the samples of a window are interpolated and
// therefore correlated.
constexpr float kImageNoiseFactor = 0.5f;

// Error of a match that does not average out over neighbours.
constexpr float kMatchingNoise_px = 0.035f;

// A range is unknown if the correlation is lower, or the relative standard deviation of the range larger.
constexpr float kMinScore = 0.3f, kMaxRelativeSigma = 0.5f;

// Ratio of the standard deviation to the mean second difference of neighbouring estimates, whose windows
// overlap. Fitted on simulated drives, together with the two noises above.
constexpr float kRoughnessFactor = 0.8f;

// Calibration of the confidence: fraction of ranges within 5 % of the truth as a function of the product of
// confidence's factors. Fitted on simulated drives that are not used for evaluation.
constexpr float kFactors[] = {0.0f,  0.0625f, 0.0875f, 0.125f, 0.175f, 0.25f,  0.35f,
                              0.45f, 0.55f,   0.65f,   0.75f,  0.85f,  0.925f, 1.0f};
constexpr float kRightFraction[] = {0.0f,   0.33f,  0.42f,  0.53f,  0.65f,  0.75f,  0.84f,
                                    0.895f, 0.933f, 0.964f, 0.983f, 0.996f, 0.999f, 1.0f};

float square(float value) {
  return value * value;
}

/// Turns a row of products of the confidence's factors into probabilities that the ranges are right.
VCHARGE_WIDE_LOOPS void calibrate(std::vector<float>* confidence) {
  std::vector<float> calibrated(confidence->size(), kRightFraction[0]);
  for (size_t i = 1; i < std::size(kFactors); ++i) {
    const float length = kFactors[i] - kFactors[i - 1];
    const float slope = (kRightFraction[i] - kRightFraction[i - 1]) / length;
    for (size_t x = 0; x < calibrated.size(); ++x) {
      calibrated[x] += slope * std::min(std::max((*confidence)[x] - kFactors[i - 1], 0.0f), length);
    }
  }
  confidence->swap(calibrated);
}

constexpr int kSupportRadius_px = 3;

/// Fraction of a pixel's neighbours inside the image that found the same surface, for the pixels of row y.
/// `padded`: inverse ranges with a margin of kSupportRadius_px columns.
std::vector<float> neighbourhoodSupport(const SweepKernels& kernels, const cv::Mat& padded,
                                        const cv::Mat& sigma, int y) {
  const int columns = sigma.cols;
  const float* middle = padded.ptr<float>(y) + kSupportRadius_px;
  const auto* row_sigma = sigma.ptr<float>(y);
  std::vector<float> tolerance(static_cast<size_t>(columns)), agree(tolerance), sum(tolerance);
  for (int x = 0; x < columns; ++x) {
    tolerance[static_cast<size_t>(x)] = 2.0f * row_sigma[x] + 0.03f * middle[x];
  }
  std::vector<const float*> rows;
  for (int v = std::max(0, y - kSupportRadius_px); v <= std::min(sigma.rows - 1, y + kSupportRadius_px);
       ++v) {
    rows.push_back(padded.ptr<float>(v) + kSupportRadius_px);
  }
  kernels.sumAgreeing({tolerance.size(), rows.data(), static_cast<int>(rows.size()), kSupportRadius_px, 1,
                       middle, tolerance.data()},
                      agree.data(), sum.data());
  for (int x = 0; x < columns; ++x) {
    const int width = std::min(columns - 1, x + kSupportRadius_px) - std::max(0, x - kSupportRadius_px) + 1;
    agree[static_cast<size_t>(x)] /= static_cast<float>(width) * static_cast<float>(rows.size());
  }
  return agree;
}

/// Confidence of the pixels of row y from their score, its lead over the second peak, the standard deviation
/// and the support of the neighbourhood.
VCHARGE_WIDE_LOOPS std::vector<float> rowConfidence(const SweepInput& input, const SurfaceEstimate& estimate,
                                                    const cv::Mat& padded, const cv::Mat& sigma, int y) {
  std::vector<float> confidence = neighbourhoodSupport(input.kernels, padded, sigma, y);
  const auto* inverse_range = estimate.inverse_range.ptr<float>(y);
  const auto* score = estimate.score.ptr<float>(y);
  const auto* second = estimate.second_score.ptr<float>(y);
  const auto* deviation = sigma.ptr<float>(y);
  constexpr float per_height = 1.0f / (1.0f - kMinScore);
  for (size_t x = 0; x < confidence.size(); ++x) {
    const float height = std::min(std::max(per_height * (score[x] - kMinScore), 0.0f), 1.0f);
    const float lead = std::min(std::max((score[x] - std::max(second[x], 0.0f)) / 0.3f, 0.0f), 1.0f);
    const float precision = 1.0f / (1.0f + square(deviation[x] / (0.05f * inverse_range[x])));
    const float factors = confidence[x] * height * (0.2f + 0.8f * lead) * precision;
    confidence[x] = inverse_range[x] > 0.0f ? factors : 0.0f;
  }
  calibrate(&confidence);
  return confidence;
}

/// Mean second difference of the inverse ranges around the pixels of row y, divided by its value for
/// independent inverse ranges with a standard deviation of 1; 0 where neighbours are unknown.
VCHARGE_WIDE_LOOPS std::vector<float> neighbourhoodRoughness(const cv::Mat& inverse_range, int y) {
  constexpr int kSteps[][2] = {{2, 0}, {0, 2}, {2, 2}, {2, -2}, {4, 0}, {0, 4}, {4, 4}, {4, -4}};
  constexpr float kPerDeviation = 2.45f;  // square root of 1 + 1 + 4
  const int columns = inverse_range.cols;
  const auto* middle = inverse_range.ptr<float>(y);
  std::vector<float> sum(static_cast<size_t>(columns), 0.0f), count(static_cast<size_t>(columns), 0.0f);
  for (const auto& step : kSteps) {
    const int above = y - step[1], below = y + step[1];
    if (std::min(above, below) < 0 || std::max(above, below) >= inverse_range.rows) {
      continue;
    }
    const auto* row_above = inverse_range.ptr<float>(above);
    const auto* row_below = inverse_range.ptr<float>(below);
    for (int x = step[0]; x < columns - step[0]; ++x) {
      const float difference =
          std::abs(row_above[x - step[0]] + row_below[x + step[0]] - 2.0f * middle[x]) / kPerDeviation;
      const bool known = difference == difference;  // NaN differs from itself
      sum[static_cast<size_t>(x)] += known ? difference : 0.0f;
      count[static_cast<size_t>(x)] += known ? 1.0f : 0.0f;
    }
  }
  for (size_t x = 0; x < sum.size(); ++x) {
    sum[x] /= std::max(count[x], 1.0f);
  }
  return sum;
}

/// Writes row y of a range map from the ranges that are kept, whose neighbourhood's roughness adds to sigma.
VCHARGE_WIDE_LOOPS void writeRow(const cv::Mat& accepted, const cv::Mat& sigma, int y, bool keeps_all,
                                 RangeMap* map) {
  const std::vector<float> roughness = neighbourhoodRoughness(accepted, y);
  const auto* inverse_range = accepted.ptr<float>(y);
  const auto* deviation = sigma.ptr<float>(y);
  auto* range = map->range_m.ptr<float>(y);
  auto* range_deviation = map->standard_deviation_m.ptr<float>(y);
  auto* confidence = map->confidence.ptr<float>(y);
  for (int x = 0; x < accepted.cols; ++x) {
    const float rough = kRoughnessFactor * roughness[static_cast<size_t>(x)];
    const float relative_sigma = std::sqrt(square(deviation[x]) + square(rough)) / inverse_range[x];
    const bool known = (inverse_range[x] > 0.0f) & (keeps_all | !(relative_sigma > kMaxRelativeSigma));
    range[x] = known ? 1.0f / inverse_range[x] : kNaN;
    range_deviation[x] = known ? relative_sigma / inverse_range[x] : kNaN;
    confidence[x] = known ? confidence[x] : 0.0f;
  }
}

}  // namespace

std::vector<NeighbourUncertainty> neighbourUncertainties(const SweepInput& input) {
  const PoseNoiseOptions& pose = input.options->pose_noise;
  std::vector<NeighbourUncertainty> result;
  for (const SweepNeighbour& neighbour : input.neighbours) {
    const double baseline_m = neighbour.translation_m.norm();
    const NeighbourNoise& noise = neighbour.noise;
    const double rotation_rad2 =
        noise.rotation_left * pose.rotationVariance_rad2(baseline_m) + noise.more_rotation_rad2;
    const double translation_m2 =
        noise.translation_left * pose.translationVariance_m2(baseline_m) + noise.more_translation_m2;
    result.push_back({neighbour.projection(), static_cast<float>(rotation_rad2),
                      static_cast<float>(translation_m2), neighbour.after});
  }
  return result;
}

UncertaintyRow uncertaintyRow(const SweepInput& input, const std::vector<NeighbourUncertainty>& neighbours,
                              const cv::Mat& inverse_range, int y) {
  const size_t first = static_cast<size_t>(y) * static_cast<size_t>(inverse_range.cols);
  UncertaintyRow row;
  row.count = static_cast<size_t>(inverse_range.cols);
  row.ray_x = input.rays->x().data() + first;
  row.ray_y = input.rays->y().data() + first;
  row.ray_z = input.rays->z().data() + first;
  row.inverse_range = inverse_range.ptr<float>(y);
  row.neighbours = neighbours.data();
  row.num_neighbours = static_cast<int>(neighbours.size());
  return row;
}

void estimateRange(const SweepInput& input, const SurfaceEstimate& estimate, RangeMap* map) {
  const PlaneSweepOptions& options = *input.options;
  const bool keeps_all = options.min_confidence == 0.0;
  const cv::Size size = estimate.score.size();
  map->range_m = pooledMat(size, CV_32FC1);
  map->standard_deviation_m = pooledMat(size, CV_32FC1);
  map->confidence = pooledMat(size, CV_32FC1);
  cv::Mat sigma = pooledMat(size, CV_32FC1), accepted = pooledMat(size, CV_32FC1);
  cv::Mat padded = pooledMat({size.width + 2 * kSupportRadius_px, size.height}, CV_32FC1);
  const std::vector<NeighbourUncertainty> neighbours = neighbourUncertainties(input);
  forEachRow(size.height, [&](int y) {
    UncertaintyRow row = uncertaintyRow(input, neighbours, estimate.inverse_range, y);
    row.voters = estimate.voters.ptr<int32_t>(y);
    row.score = estimate.score.ptr<float>(y);
    row.curvature = estimate.curvature.ptr<float>(y);
    row.noise_factor = kImageNoiseFactor / static_cast<float>(kMatchingWindow_px * kMatchingWindow_px);
    row.matching_noise_px = kMatchingNoise_px;
    row.scale_noise = static_cast<float>(options.pose_noise.scale);
    input.kernels.inverseRangeSigma(row, sigma.ptr<float>(y));
    copyPadded(row.inverse_range, size.width, kSupportRadius_px, padded.ptr<float>(y));
  });
  // Selects the ranges to be kept.
  forEachRow(size.height, [&](int y) {
    const std::vector<float> confidence = rowConfidence(input, estimate, padded, sigma, y);
    const auto* inverse_range = estimate.inverse_range.ptr<float>(y);
    const auto* score = estimate.score.ptr<float>(y);
    const auto* at_limit = estimate.at_limit.ptr<uint8_t>(y);
    auto* out = accepted.ptr<float>(y);
    const auto min_confidence = static_cast<float>(options.min_confidence);
    for (int x = 0; x < size.width; ++x) {
      const bool passes = (at_limit[x] == 0) & (score[x] >= kMinScore) &
                          (confidence[static_cast<size_t>(x)] >= min_confidence);
      const bool is_accepted = (inverse_range[x] > 0.0f) & (passes | keeps_all);
      out[x] = is_accepted ? inverse_range[x] : kNaN;
    }
    std::copy(confidence.begin(), confidence.end(), map->confidence.ptr<float>(y));
  });
  forEachRow(size.height, [&](int y) { writeRow(accepted, sigma, y, keeps_all, map); });
}

}  // namespace vcharge
