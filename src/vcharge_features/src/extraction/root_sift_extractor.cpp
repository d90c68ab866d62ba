#include <algorithm>
#include <cmath>
#include <vector>

#include <opencv2/features2d.hpp>

#include "extraction/even_selection.h"
#include "extraction/feature_extractors.h"

namespace vcharge {
namespace {

constexpr float kDegree = 0.017453292519943295F;
constexpr int kMinSize_px = 16;
// OpenCV's defaults, which are those of Lowe.
constexpr int kOctaveLayers = 3;
constexpr double kEdgeThreshold = 10.0;
constexpr double kSigma_px = 1.6;

/// Square roots of descriptors scaled to a sum of 1: their Euclidean distance is the Hellinger distance.
void convertToRootSift(cv::Mat* descriptors) {
  for (int i = 0; i < descriptors->rows; ++i) {
    auto* row = descriptors->ptr<float>(i);
    float sum = 0.0F;
    for (int k = 0; k < descriptors->cols; ++k) {
      sum += row[k];
    }
    const float scale = sum > 0.0F ? 1.0F / sum : 0.0F;
    for (int k = 0; k < descriptors->cols; ++k) {
      row[k] = std::sqrt(row[k] * scale);
    }
  }
}

/// Detects features, selects some of them, then describes these.
class RootSiftExtractor : public FeatureExtractor {
 public:
  explicit RootSiftExtractor(const FeatureExtractorOptions& options) : FeatureExtractor(options) {}
  int descriptorType() const override { return CV_32FC1; }
  int descriptorColumns() const override { return 128; }

 protected:
  ImageFeatures extractChecked(const cv::Mat& image, const cv::Mat& mask) const override {
    ImageFeatures features;
    if (std::min(image.cols, image.rows) < kMinSize_px) {
      return features;
    }
    // OpenCV's algorithms are not const, so each call has its own.
    const cv::Ptr<cv::Feature2D> sift =
        cv::SIFT::create(0, kOctaveLayers, options().sift_contrast_threshold, kEdgeThreshold, kSigma_px);
    std::vector<cv::KeyPoint> found;
    sift->detect(image, found, mask);
    std::vector<SelectionCandidate> candidates;
    candidates.reserve(found.size());
    for (const cv::KeyPoint& point : found) {
      candidates.push_back({point.pt, point.response});
    }
    std::vector<cv::KeyPoint> kept;
    for (const int i :
         selectEvenly(candidates, image.size(), kGridColumns, kGridRows, options().max_features)) {
      kept.push_back(found[i]);
    }
    if (kept.empty()) {
      return features;
    }
    sift->compute(image, kept, features.descriptors);
    convertToRootSift(&features.descriptors);
    features.keypoints.reserve(kept.size());
    for (const cv::KeyPoint& point : kept) {
      features.keypoints.push_back(
          {point.pt, point.size, std::max(point.angle, 0.0F) * kDegree, point.response});
    }
    return features;
  }
};

}  // namespace

std::unique_ptr<FeatureExtractor> makeRootSiftExtractor(const FeatureExtractorOptions& options) {
  return std::make_unique<RootSiftExtractor>(options);
}

}  // namespace vcharge
