#pragma once

#include <vector>

#include <opencv2/core.hpp>

#include "vcharge_features/descriptor_matching.h"

namespace vcharge {

/// Returns true for binary descriptors, false for numbers. Throws std::invalid_argument "<source>:
/// <argument>: ..." for descriptors that are neither CV_8UC1 with 32 columns nor CV_32FC1, or not finite.
bool checkDescriptors(const cv::Mat& descriptors, const char* source, const char* argument);

/// Returns true for binary descriptors. Throws std::invalid_argument unless both can be compared.
bool checkComparable(const cv::Mat& first, const cv::Mat& second, const char* source);

/// Pairs of neighbours that pass the tests of the options, ordered by first_index.
std::vector<FeatureMatch> selectMatches(const DescriptorNeighbours& neighbours, const MatchOptions& options);

}  // namespace vcharge
