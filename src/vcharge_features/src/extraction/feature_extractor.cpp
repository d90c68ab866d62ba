#include "vcharge_features/feature_extractor.h"

#include <cmath>
#include <cstring>
#include <stdexcept>

#include "extraction/feature_extractors.h"
#include "vcharge_core/camera/ray_table.h"

namespace vcharge {
namespace {

std::string describeMat(const cv::Mat& mat) {
  return std::to_string(mat.cols) + "x" + std::to_string(mat.rows) + " " + cv::typeToString(mat.type());
}

}  // namespace

FeatureExtractorOptions FeatureExtractorOptions::mapping() {
  FeatureExtractorOptions options;
  options.type = FeatureType::kRootSift;
  options.max_features = 4000;
  return options;
}

FeatureExtractor::FeatureExtractor(const FeatureExtractorOptions& options) : options_(options) {
  options.validate();
}

ImageFeatures FeatureExtractor::extract(const cv::Mat& image, const cv::Mat& mask) const {
  if (image.empty() || image.dims != 2 || image.type() != CV_8UC1) {
    throw std::invalid_argument("FeatureExtractor: image: expected a non-empty 8UC1, got " +
                                describeMat(image));
  }
  if (!mask.empty() && (mask.size() != image.size() || mask.type() != CV_8UC1)) {
    throw std::invalid_argument("FeatureExtractor: mask: expected 8UC1 of the image's size " +
                                describeMat(image) + ", got " + describeMat(mask));
  }
  ImageFeatures features = extractChecked(image, mask);
  if (features.empty()) {
    // An empty matrix of the right type and number of columns.
    features.descriptors.create(0, descriptorColumns(), descriptorType());
  }
  return features;
}

std::unique_ptr<FeatureExtractor> makeFeatureExtractor(const FeatureExtractorOptions& options) {
  options.validate();
  switch (options.type) {
    case FeatureType::kFastBrief:
      return makeFastBriefExtractor(options);
    case FeatureType::kRootSift:
      return makeRootSiftExtractor(options);
  }
  throw std::invalid_argument("type: unknown feature type " + std::to_string(static_cast<int>(options.type)));
}

cv::Mat makeFeatureMask(const RigCamera& camera) {
  const RayTable rays(camera.model, camera.image_size_px, camera.field_of_view_rad, camera.mask);
  cv::Mat mask(camera.image_size_px, CV_8UC1);
  for (int y = 0; y < mask.rows; ++y) {
    for (int x = 0; x < mask.cols; ++x) {
      mask.at<uint8_t>(y, x) = rays.valid(x, y) ? 255 : 0;
    }
  }
  return mask;
}

}  // namespace vcharge
