#include "places/descriptor_clustering.h"

#include <tbb/parallel_for.h>

#include <algorithm>
#include <cmath>
#include <random>

#include "matching/descriptor_kernels.h"

namespace vcharge {
namespace {

/// Hamming or squared Euclidean distances to rows [0, count) of `rows`.
void distancesToRows(const cv::Mat& descriptors, int32_t query, const cv::Mat& rows, int count,
                     float* distances) {
  if (descriptors.type() == CV_8UC1) {
    hammingToRows(descriptors.ptr(query), rows.ptr(), rows.step, nullptr, static_cast<size_t>(count),
                  distances);
  } else {
    squaredDistanceToRows(descriptors.ptr<float>(query), static_cast<size_t>(descriptors.cols),
                          rows.ptr<float>(), rows.step1(), nullptr, static_cast<size_t>(count), distances);
  }
}

/// Uniform in [0, 1), identical with every standard library.
double drawUnit(std::mt19937_64* generator) {
  return std::ldexp(static_cast<double>((*generator)() >> 11), -53);
}

cv::Mat drawCentres(const cv::Mat& descriptors, const std::vector<int32_t>& rows, int num_clusters,
                    uint64_t seed) {
  std::mt19937_64 generator(seed);
  cv::Mat centres(num_clusters, descriptors.cols, descriptors.type());
  std::vector<float> to_nearest(rows.size(), INFINITY);
  size_t chosen = generator() % rows.size();
  int count = 0;
  while (true) {
    descriptors.row(rows[chosen]).copyTo(centres.row(count));
    ++count;
    if (count == num_clusters) {
      return centres;
    }
    tbb::parallel_for(size_t{0}, rows.size(), [&](size_t i) {
      float distance;
      distancesToRows(descriptors, rows[i], centres.row(count - 1), 1, &distance);
      to_nearest[i] = std::min(to_nearest[i], distance);
    });
    // Sampled in proportion to the distance (bits) or squared distance.
    double sum = 0.0;
    for (const float distance : to_nearest) {
      sum += distance;
    }
    if (!(sum > 0.0)) {
      return centres.rowRange(0, count).clone();  // every descriptor is a centre
    }
    double rest = drawUnit(&generator) * sum;
    chosen = rows.size();
    for (size_t i = 0; i < rows.size() && rest >= 0.0; ++i) {
      if (to_nearest[i] > 0.0F) {
        chosen = i;
        rest -= to_nearest[i];
      }
    }
  }
}

void setToMean(const cv::Mat& descriptors, const std::vector<int32_t>& members, cv::Mat centre) {
  if (descriptors.type() == CV_8UC1) {
    std::vector<int> ones(static_cast<size_t>(8 * descriptors.cols), 0);
    for (const int32_t row : members) {
      const uint8_t* bytes = descriptors.ptr(row);
      for (size_t bit = 0; bit < ones.size(); ++bit) {
        ones[bit] += (bytes[bit / 8] >> (bit % 8)) & 1;
      }
    }
    centre.setTo(0);
    for (size_t bit = 0; bit < ones.size(); ++bit) {
      if (2 * ones[bit] > static_cast<int>(members.size())) {
        centre.ptr()[bit / 8] |= static_cast<uint8_t>(1U << (bit % 8));
      }
    }
    return;
  }
  std::vector<double> sum(static_cast<size_t>(descriptors.cols), 0.0);
  for (const int32_t row : members) {
    const auto* values = descriptors.ptr<float>(row);
    for (size_t k = 0; k < sum.size(); ++k) {
      sum[k] += values[k];
    }
  }
  for (size_t k = 0; k < sum.size(); ++k) {
    centre.ptr<float>()[k] = static_cast<float>(sum[k] / static_cast<double>(members.size()));
  }
}

}  // namespace

DescriptorClusters clusterDescriptors(const cv::Mat& descriptors, const std::vector<int32_t>& rows,
                                      int num_clusters, int max_iterations, uint64_t seed) {
  DescriptorClusters clusters;
  if (rows.empty()) {
    return clusters;
  }
  cv::Mat centres =
      drawCentres(descriptors, rows, std::min(num_clusters, static_cast<int>(rows.size())), seed);
  std::vector<int> nearest(rows.size(), -1);
  for (int iteration = 0; iteration < max_iterations; ++iteration) {
    std::vector<uint8_t> changed(rows.size(), 0);
    tbb::parallel_for(size_t{0}, rows.size(), [&](size_t i) {
      std::vector<float> distances(static_cast<size_t>(centres.rows));
      distancesToRows(descriptors, rows[i], centres, centres.rows, distances.data());
      const int best =
          static_cast<int>(std::min_element(distances.begin(), distances.end()) - distances.begin());
      changed[i] = best != nearest[i] ? 1 : 0;
      nearest[i] = best;
    });
    if (std::find(changed.begin(), changed.end(), 1) == changed.end()) {
      break;
    }
    clusters.members.assign(static_cast<size_t>(centres.rows), {});
    for (size_t i = 0; i < rows.size(); ++i) {
      clusters.members[nearest[i]].push_back(rows[i]);
    }
    tbb::parallel_for(0, centres.rows, [&](int c) {
      if (!clusters.members[c].empty()) {
        setToMean(descriptors, clusters.members[c], centres.row(c));
      }
    });
  }
  cv::Mat kept(0, descriptors.cols, descriptors.type());
  std::vector<std::vector<int32_t>> members;
  for (size_t c = 0; c < clusters.members.size(); ++c) {
    if (!clusters.members[c].empty()) {
      kept.push_back(centres.row(static_cast<int>(c)));
      members.push_back(std::move(clusters.members[c]));
    }
  }
  clusters.centres = kept;
  clusters.members = std::move(members);
  return clusters;
}

}  // namespace vcharge
