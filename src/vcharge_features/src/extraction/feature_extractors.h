#pragma once

#include <memory>

#include "vcharge_features/feature_extractor.h"

namespace vcharge {

// One function per implementation, for options that were validated.
std::unique_ptr<FeatureExtractor> makeFastBriefExtractor(const FeatureExtractorOptions& options);
std::unique_ptr<FeatureExtractor> makeRootSiftExtractor(const FeatureExtractorOptions& options);

}  // namespace vcharge
