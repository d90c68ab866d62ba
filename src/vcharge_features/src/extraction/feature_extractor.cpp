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

void FastBriefOptions::validate() const {
  requireField(threshold >= 1 && threshold <= 254, "threshold", "must be in [1, 254]", threshold);
  requireField(num_levels >= 1 && num_levels <= 12, "num_levels", "must be in [1, 12]", num_levels);
  requireField(level_scale > 1.0 && level_scale <= 4.0, "level_scale", "must be in (1, 4]", level_scale);
}

void SiftOptions::validate() const {
  requireField(contrast_threshold >= 0.0 && contrast_threshold <= 1.0, "contrast_threshold",
               "must be in [0, 1]", contrast_threshold);
  requireField(edge_threshold > 1.0 && std::isfinite(edge_threshold), "edge_threshold",
               "must be finite and larger than 1", edge_threshold);
  requireField(sigma_px > 0.5 && sigma_px <= 10.0, "sigma_px", "must be in (0.5, 10]", sigma_px);
  requireField(octave_layers >= 1 && octave_layers <= 16, "octave_layers", "must be in [1, 16]",
               octave_layers);
}

FeatureExtractorOptions FeatureExtractorOptions::mapping() {
  FeatureExtractorOptions options;
  options.type = FeatureType::kRootSift;
  options.max_features = 4000;
  return options;
}

void FeatureExtractorOptions::validate() const {
  requireField(max_features >= 1 && max_features <= 1000000, "max_features", "must be in [1, 1000000]",
               max_features);
  requireField(grid_columns >= 1 && grid_columns <= 1000, "grid_columns", "must be in [1, 1000]",
               grid_columns);
  requireField(grid_rows >= 1 && grid_rows <= 1000, "grid_rows", "must be in [1, 1000]", grid_rows);
  validateInner("fast_brief", fast_brief);
  validateInner("sift", sift);
  requireField(orb_threshold >= 1 && orb_threshold <= 254, "orb_threshold", "must be in [1, 254]",
               orb_threshold);
  requireField(surf_threshold >= 0.0 && std::isfinite(surf_threshold), "surf_threshold",
               "must be finite and not negative", surf_threshold);
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
    case FeatureType::kOrb:
      return makeOrbExtractor(options);
    case FeatureType::kSift:
    case FeatureType::kRootSift:
      return makeSiftExtractor(options);
    case FeatureType::kSurf:
      return makeSurfExtractor(options);
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
