#pragma once

#include <cstdint>
#include <vector>

#include <opencv2/core.hpp>

namespace vcharge {

/// Clusters of the rows of a matrix.
struct DescriptorClusters {
  cv::Mat centres;                            ///< same type as the descriptors, one row per cluster
  std::vector<std::vector<int32_t>> members;  ///< rows of the matrix; every cluster has members
};

/// At most `num_clusters` clusters of the chosen rows: k-means (CV_32FC1) or k-medians by the majority of
/// each bit (CV_8UC1), initialized by k-means++ (Arthur and Vassilvitskii, SODA 2007). Fewer clusters if
/// there are fewer different descriptors. The same seed gives the same clusters on any number of threads.
DescriptorClusters clusterDescriptors(const cv::Mat& descriptors, const std::vector<int32_t>& rows,
                                      int num_clusters, int max_iterations, uint64_t seed);

}  // namespace vcharge
