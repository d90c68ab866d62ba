#pragma once

#include <cstdint>
#include <vector>

#include <opencv2/core.hpp>

namespace vcharge {

/// Clusters of rows of a matrix.
struct DescriptorClusters {
  cv::Mat centres;                            ///< of the descriptors' type, one row per cluster
  std::vector<std::vector<int32_t>> members;  ///< rows of the matrix; no cluster is empty
};

/// At most `num_clusters` clusters of the chosen rows: k-means (CV_32FC1) or k-medians by the majority of
/// each bit (CV_8UC1), started as k-means++ (Arthur and Vassilvitskii, SODA 2007). Fewer where there are
/// fewer different descriptors. The same seed gives the same clusters on any number of threads.
DescriptorClusters clusterDescriptors(const cv::Mat& descriptors, const std::vector<int32_t>& rows,
                                      int num_clusters, int max_iterations, uint64_t seed);

}  // namespace vcharge
