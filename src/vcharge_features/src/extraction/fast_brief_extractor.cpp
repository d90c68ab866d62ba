#include <algorithm>
#include <vector>

#include <opencv2/features2d.hpp>
#include <opencv2/imgproc.hpp>

#include "extraction/brief_descriptor.h"
#include "extraction/even_selection.h"
#include "extraction/feature_extractors.h"

namespace vcharge {
namespace {

constexpr int kMargin_px = BriefDescriptor::kRadius_px + 1;
/// Number of pixels around a corner that FAST uses.
constexpr int kFastRadius_px = 3;
/// A binomial filter (sigma 1 px). Twice the blur, as ORB's, reduces the precision at 2 m on real images by a
/// fifth.
constexpr int kBlurWindow_px = 5;

std::vector<SelectionCandidate> findCorners(const cv::Mat& image, const cv::Mat& mask, int threshold) {
  constexpr int kBorder_px = kMargin_px - kFastRadius_px;
  const cv::Rect inside(kBorder_px, kBorder_px, image.cols - 2 * kBorder_px, image.rows - 2 * kBorder_px);
  std::vector<cv::KeyPoint> corners;
  cv::FAST(image(inside), corners, threshold, true);
  std::vector<SelectionCandidate> candidates;
  for (const cv::KeyPoint& corner : corners) {
    const cv::Point pixel(cvRound(corner.pt.x) + inside.x, cvRound(corner.pt.y) + inside.y);
    if (mask.empty() || mask.at<uint8_t>(pixel) != 0) {
      candidates.push_back({cv::Point2f(pixel), corner.response});
    }
  }
  return candidates;
}

class FastBriefExtractor : public FeatureExtractor {
 public:
  explicit FastBriefExtractor(const FeatureExtractorOptions& options) : FeatureExtractor(options) {}
  int descriptorType() const override { return CV_8UC1; }
  int descriptorColumns() const override { return BriefDescriptor::kBytes; }

 protected:
  ImageFeatures extractChecked(const cv::Mat& image, const cv::Mat& mask) const override;
};

ImageFeatures FastBriefExtractor::extractChecked(const cv::Mat& image, const cv::Mat& mask) const {
  ImageFeatures features;
  if (std::min(image.cols, image.rows) <= 2 * kMargin_px) {
    return features;
  }
  std::vector<SelectionCandidate> candidates = findCorners(image, mask, options().fast_threshold);
  if (static_cast<int>(candidates.size()) < options().max_features) {
    candidates = findCorners(image, mask, std::max(1, options().fast_threshold / 2));
  }
  const std::vector<int> selected =
      selectEvenly(candidates, image.size(), kGridColumns, kGridRows, options().max_features);
  cv::Mat smooth;
  cv::GaussianBlur(image, smooth, cv::Size(kBlurWindow_px, kBlurWindow_px), 0.0, 0.0,
                   cv::BORDER_REFLECT_101 | cv::BORDER_ISOLATED);
  const BriefDescriptor brief(static_cast<int64_t>(smooth.step));
  features.descriptors.create(static_cast<int>(selected.size()), BriefDescriptor::kBytes, CV_8UC1);
  features.keypoints.reserve(selected.size());
  for (size_t row = 0; row < selected.size(); ++row) {
    const SelectionCandidate& candidate = candidates[selected[row]];
    Keypoint keypoint;
    keypoint.position_px = candidate.position_px;
    keypoint.size_px = static_cast<float>(2 * BriefDescriptor::kRadius_px + 1);
    keypoint.response = candidate.response;
    const cv::Point pixel = candidate.position_px;
    brief.describe(smooth.ptr(pixel.y, pixel.x), features.descriptors.ptr(static_cast<int>(row)));
    features.keypoints.push_back(keypoint);
  }
  return features;
}

}  // namespace

std::unique_ptr<FeatureExtractor> makeFastBriefExtractor(const FeatureExtractorOptions& options) {
  return std::make_unique<FastBriefExtractor>(options);
}

}  // namespace vcharge
