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
// The classifier's window, the height of a person in it, and the grid of its histograms.
constexpr int kWindow_px = 64, kWindowHeight_px = 128, kPerson_px = 96, kStep_px = 8;
// Larger people are found in a panorama of half the size.
constexpr double kShrink = 0.6;
constexpr double kAllScores = -1e3;
constexpr int kRim_px = 5;

cv::HOGDescriptor makeClassifier() {
  cv::HOGDescriptor hog;
  hog.setSVMDetector(cv::HOGDescriptor::getDefaultPeopleDetector());
  return hog;
}

}  // namespace

PersonLikeness::PersonLikeness() : hog_(makeClassifier()) {}

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
      const cv::Size size(kWindow_px + 2 * std::max(kStep_px, aside_px), kWindowHeight_px + 2 * kStep_px);
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
      cv::Mat searched;
      cv::warpAffine(source, searched, cv::Matx23d(step, 0.0, left, 0.0, step, top), size,
                     cv::INTER_LINEAR | cv::WARP_INVERSE_MAP, cv::BORDER_REPLICATE);
      std::vector<cv::Point> places;
      std::vector<double> scores;
      hog_.detect(searched, places, scores, kAllScores, cv::Size(kStep_px, kStep_px), cv::Size(0, 0));
      for (size_t i = 0; i < scores.size(); ++i) {
        if (scores[i] > best.score) {
          const double beside_px = places[i].x + 0.5 * kWindow_px - 0.5 * size.width;
          best = {scores[i], -beside_px / scale * panorama.pixel_rad()};  // columns run clockwise
        }
      }
    }
  }
  return best;
}

}  // namespace vcharge
