#include "matching/binary_signature.h"

#include <array>
#include <cstdint>
#include <random>
#include <utility>

#include <tbb/parallel_for.h>

#include "matching/descriptor_kernels.h"

namespace vcharge {
namespace {

constexpr size_t kBits = 8 * kBinaryDescriptorBytes;

/// The two columns that each bit compares.
std::array<std::pair<int, int>, kBits> pairsOf(int columns) {
  std::mt19937 random(1);
  std::array<std::pair<int, int>, kBits> pairs;
  const auto count = static_cast<uint32_t>(columns);
  for (auto& [first, second] : pairs) {
    first = static_cast<int>(random() % count);
    // A column different from the first, if there is one.
    const uint32_t step = count > 1 ? 1 + static_cast<uint32_t>(random() % (count - 1)) : 0;
    second = static_cast<int>((static_cast<uint32_t>(first) + step) % count);
  }
  return pairs;
}

}  // namespace

cv::Mat meanDescriptor(const cv::Mat& descriptors) {
  cv::Mat mean = cv::Mat::zeros(1, descriptors.cols, CV_32FC1);
  if (descriptors.rows > 0) {
    cv::reduce(descriptors, mean, 0, cv::REDUCE_AVG, CV_32F);
  }
  return mean;
}

cv::Mat binarySignatures(const cv::Mat& descriptors, const cv::Mat& mean) {
  const auto pairs = pairsOf(descriptors.cols);
  cv::Mat signatures = cv::Mat::zeros(descriptors.rows, static_cast<int>(kBinaryDescriptorBytes), CV_8UC1);
  tbb::parallel_for(0, descriptors.rows, [&](int row) {
    const auto* numbers = descriptors.ptr<float>(row);
    const auto* means = mean.ptr<float>();
    uint8_t* signature = signatures.ptr(row);
    for (size_t bit = 0; bit < kBits; ++bit) {
      const auto [first, second] = pairs[bit];
      if (numbers[first] - means[first] > numbers[second] - means[second]) {
        signature[bit / 8] = static_cast<uint8_t>(signature[bit / 8] | (1U << (bit % 8)));
      }
    }
  });
  return signatures;
}

}  // namespace vcharge
