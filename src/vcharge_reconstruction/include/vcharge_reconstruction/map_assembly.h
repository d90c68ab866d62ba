#pragma once

#include <memory>
#include <vector>

#include "vcharge_core/sparse_map/sparse_map.h"
#include "vcharge_features/feature_extractor.h"
#include "vcharge_features/vocabulary_tree.h"
#include "vcharge_reconstruction/loop_closure.h"
#include "vcharge_reconstruction/mapping_data.h"

namespace vcharge {

/// The map that the adjusted data make: landmarks with a position, and their observations. Observations
/// without a feature of their own have the descriptor of the landmark's nearest keyframe that has one.
std::shared_ptr<const SparseMap> assembleMap(const MappingData& data, const std::vector<LoopEdge>& loop_edges,
                                             const FeatureExtractorOptions& features,
                                             const VocabularyTree& vocabulary);

}  // namespace vcharge
