#pragma once

#include <algorithm>
#include <cstddef>
#include <cstdint>

#include <opencv2/core.hpp>

namespace vcharge {

/// A number that tells whether an image repeats the one before. It samples about 4000 bytes: the noise of a
/// working camera changes many of them. `bytes` may be compressed.
inline uint64_t fingerprintOf(const uint8_t* bytes, size_t size) {
  constexpr size_t kSamples = 4096;
  const size_t step = std::max<size_t>(1, size / kSamples);
  uint64_t hash = 14695981039346656037ULL;  // FNV-1a
  for (size_t i = 0; i < size; i += step) {
    hash = (hash ^ bytes[i]) * 1099511628211ULL;
  }
  return (hash ^ size) * 1099511628211ULL;
}

/// The same for pixels (CV_8UC1).
inline uint64_t fingerprintOf(const cv::Mat& pixels) {
  constexpr int kSamplesPerSide = 64;
  const int row_step = std::max(1, pixels.rows / kSamplesPerSide);
  const int column_step = std::max(1, pixels.cols / kSamplesPerSide);
  uint64_t hash = 14695981039346656037ULL;
  for (int row = 0; row < pixels.rows; row += row_step) {
    const uint8_t* line = pixels.ptr<uint8_t>(row);
    for (int column = 0; column < pixels.cols; column += column_step) {
      hash = (hash ^ line[column]) * 1099511628211ULL;
    }
  }
  return hash;
}

}  // namespace vcharge
