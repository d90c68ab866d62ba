#include <algorithm>
#include <cmath>
#include <vector>

#include <opencv2/features2d.hpp>

#include "extraction/even_selection.h"
#include "extraction/feature_extractors.h"

namespace vcharge {
namespace {

constexpr float kDegree = 0.017453292519943295F;

/// Detects, spreads, then describes what was kept.
class OpenCvExtractor : public FeatureExtractor {
 protected:
  explicit OpenCvExtractor(const FeatureExtractorOptions& options) : FeatureExtractor(options) {}

  /// OpenCV's algorithms are not const: one per call.
  virtual cv::Ptr<cv::Feature2D> create() const = 0;
  virtual int minSize_px() const = 0;
  virtual void finish(cv::Mat* /*descriptors*/) const {}

  ImageFeatures extractChecked(const cv::Mat& image, const cv::Mat& mask) const override {
    ImageFeatures features;
    if (std::min(image.cols, image.rows) < minSize_px()) {
      return features;
    }
    const cv::Ptr<cv::Feature2D> algorithm = create();
    std::vector<cv::KeyPoint> found;
    algorithm->detect(image, found, mask);
    std::vector<SelectionCandidate> candidates;
    candidates.reserve(found.size());
    for (const cv::KeyPoint& point : found) {
      candidates.push_back({point.pt, point.response});
    }
    std::vector<cv::KeyPoint> kept;
    for (const int i : selectEvenly(candidates, image.size(), options().grid_columns, options().grid_rows,
                                    options().max_features)) {
      kept.push_back(found[i]);
    }
    if (kept.empty()) {
      return features;
    }
    algorithm->compute(image, kept, features.descriptors);
    finish(&features.descriptors);
    features.keypoints.reserve(kept.size());
    for (const cv::KeyPoint& point : kept) {
      features.keypoints.push_back(
          {point.pt, point.size, std::max(point.angle, 0.0F) * kDegree, point.response});
    }
    return features;
  }
};

class OrbExtractor : public OpenCvExtractor {
 public:
  explicit OrbExtractor(const FeatureExtractorOptions& options) : OpenCvExtractor(options) {}
  int descriptorType() const override { return CV_8UC1; }
  int descriptorColumns() const override { return 32; }

 protected:
  int minSize_px() const override { return 64; }
  cv::Ptr<cv::Feature2D> create() const override {
    // ORB keeps the strongest of the whole image: without many more there is nothing left to spread.
    return cv::ORB::create(std::max(10 * options().max_features, 20000), 1.2F, 8, 31, 0, 2,
                           cv::ORB::FAST_SCORE, 31, options().orb_threshold);
  }
};

class SiftExtractor : public OpenCvExtractor {
 public:
  explicit SiftExtractor(const FeatureExtractorOptions& options) : OpenCvExtractor(options) {}
  int descriptorType() const override { return CV_32FC1; }
  int descriptorColumns() const override { return 128; }

 protected:
  int minSize_px() const override { return 16; }
  cv::Ptr<cv::Feature2D> create() const override {
    const SiftOptions& sift = options().sift;
    return cv::SIFT::create(0, sift.octave_layers, sift.contrast_threshold, sift.edge_threshold,
                            sift.sigma_px);
  }
  void finish(cv::Mat* descriptors) const override {
    if (options().type != FeatureType::kRootSift) {
      return;
    }
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
};

}  // namespace

std::unique_ptr<FeatureExtractor> makeOrbExtractor(const FeatureExtractorOptions& options) {
  return std::make_unique<OrbExtractor>(options);
}

std::unique_ptr<FeatureExtractor> makeSiftExtractor(const FeatureExtractorOptions& options) {
  return std::make_unique<SiftExtractor>(options);
}

}  // namespace vcharge
