#include "bodies/person_likeness.h"

#include <algorithm>
#include <limits>
#include <vector>

#include <opencv2/imgproc.hpp>

namespace vcharge {
namespace {

constexpr double kNearest_m = 0.8, kFarthest_m = 12.0;
// Ranges relative to the expected one, and heights of people, that are searched.
constexpr double kRanges[] = {0.85, 1.0, 1.18}, kHeights_m[] = {1.2, 1.7};
// Distance across the view that is searched to each side.
constexpr double kAside_m = 0.4;
// Height of a person in the classifier's window.
constexpr int kPerson_px = 96;
constexpr int kStep_px = PeopleClassifier::kStep_px;
// Larger people are found in a panorama of half the size.
constexpr double kShrink = 0.6;
constexpr int kRim_px = 5;

/// Samples an image (CV_8UC1) bilinearly on a grid, and continues it beyond its border. Returns CV_32FC1,
/// square roots.
cv::Mat sampleRoots(const cv::Mat& image, double left, double top, double step, cv::Size size) {
  struct Sample {
    int low, high;
    float part;  // of the high one
  };
  const auto samplesOf = [step](double first, int count, int length) {
    std::vector<Sample> samples;
    for (int i = 0; i < count; ++i) {
      const double at = std::clamp(first + i * step, 0.0, length - 1.0);
      const int low = static_cast<int>(at);
      samples.push_back({low, std::min(low + 1, length - 1), static_cast<float>(at - low)});
    }
    return samples;
  };
  const std::vector<Sample> columns = samplesOf(left, size.width, image.cols);
  const std::vector<Sample> rows = samplesOf(top, size.height, image.rows);
  cv::Mat roots(size, CV_32FC1);
  for (int y = 0; y < size.height; ++y) {
    const Sample& row = rows[static_cast<size_t>(y)];
    const auto* upper = image.ptr<uint8_t>(row.low);
    const auto* lower = image.ptr<uint8_t>(row.high);
    auto* out = roots.ptr<float>(y);
    for (int x = 0; x < size.width; ++x) {
      const Sample& column = columns[static_cast<size_t>(x)];
      const auto blend = [](float a, float b, float part) { return a + part * (b - a); };
      out[x] = blend(blend(upper[column.low], upper[column.high], column.part),
                     blend(lower[column.low], lower[column.high], column.part), row.part);
    }
  }
  cv::sqrt(roots, roots);
  return roots;
}

}  // namespace

std::optional<PersonMatch> PersonLikeness::find(const Panorama& panorama, const cv::Mat& now,
                                                const BodyBearing& expected, double camera_height_m) const {
  const double column = panorama.columnOf(expected.azimuth_rad);
  if (expected.range_m < kNearest_m || expected.range_m > kFarthest_m || column < kRim_px ||
      column > now.cols - kRim_px) {
    return std::nullopt;
  }
  PersonMatch best;
  best.score = -std::numeric_limits<double>::infinity();
  cv::Mat half;
  for (const double factor : kRanges) {
    for (const double height_m : kHeights_m) {
      const double range_m = factor * expected.range_m;
      const double foot = panorama.rowOf(-camera_height_m / range_m);
      const double head = panorama.rowOf((height_m - camera_height_m) / range_m);
      const double scale = kPerson_px / (foot - head);  // pixels of the window in one of the panorama
      const int aside_px = cvRound(kAside_m / range_m / panorama.pixel_rad() * scale / kStep_px) * kStep_px;
      const cv::Size size(PeopleClassifier::kWidth_px + 2 * std::max(kStep_px, aside_px),
                          PeopleClassifier::kHeight_px + 2 * kStep_px);
      double step = 1.0 / scale, left = column - 0.5 * size.width * step;
      double top = head - 0.5 * (size.height - kPerson_px) * step;
      cv::Mat source = now;
      if (scale < kShrink) {
        if (half.empty()) {
          cv::resize(now, half, cv::Size(), 0.5, 0.5, cv::INTER_AREA);
        }
        source = half;
        step *= 0.5;
        left *= 0.5;
        top *= 0.5;
      }
      const cv::Mat scores = classifier_.scores(sampleRoots(source, left, top, step, size));
      double highest = 0.0;
      cv::Point at;
      cv::minMaxLoc(scores, nullptr, &highest, nullptr, &at);
      if (highest > best.score) {
        const double beside_px = kStep_px * (at.x - 0.5 * (scores.cols - 1));
        best = {highest, -beside_px / scale * panorama.pixel_rad()};  // columns run clockwise
      }
    }
  }
  return best;
}

}  // namespace vcharge
