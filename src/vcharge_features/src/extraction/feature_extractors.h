#pragma once

#include <memory>

#include "vcharge_features/feature_extractor.h"

namespace vcharge {

// One function per implementation, for options that were validated.
std::unique_ptr<FeatureExtractor> makeFastBriefExtractor(const FeatureExtractorOptions& options);
std::unique_ptr<FeatureExtractor> makeOrbExtractor(const FeatureExtractorOptions& options);
/// kSift or kRootSift.
std::unique_ptr<FeatureExtractor> makeSiftExtractor(const FeatureExtractorOptions& options);
/// std::invalid_argument in a build without dlib.
std::unique_ptr<FeatureExtractor> makeSurfExtractor(const FeatureExtractorOptions& options);

}  // namespace vcharge
