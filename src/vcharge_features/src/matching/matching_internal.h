#pragma once

#include <vector>

#include <opencv2/core.hpp>

#include "vcharge_features/descriptor_matching.h"

namespace vcharge {

/// Whether the rows are binary descriptors, else they are numbers. std::invalid_argument "<source>:
/// <argument>: ..." for descriptors that are neither CV_8UC1 with 32 columns nor CV_32FC1, or not finite.
bool checkDescriptors(const cv::Mat& descriptors, const char* source, const char* argument);

/// std::invalid_argument naming both unless they may be compared. True for binary ones.
bool checkComparable(const cv::Mat& first, const cv::Mat& second, const char* source);

/// The pairs of neighbours that pass the options' tests, in order of first_index.
std::vector<FeatureMatch> selectMatches(const DescriptorNeighbours& neighbours, const MatchOptions& options);

}  // namespace vcharge
