#include "bodies/people_classifier.h"

#include <algorithm>
#include <cmath>

#include <Eigen/Core>
#include <opencv2/objdetect.hpp>

#include "vcharge_core/base/error.h"

namespace vcharge {
namespace {

constexpr int kCell_px = 8;
// A block's histograms are normalized, clipped, and normalized again, with these regularizations.
constexpr float kClip = 0.2F, kFirstRegularization = 3.6F, kSecondRegularization = 1e-3F;

/// Gaussian weights about the middle of a block of two cells, spread bilinearly over them; separable.
template <size_t kSize>
std::array<std::array<float, kSize>, 2> cellWeights() {
  std::array<std::array<float, kSize>, 2> weights{};
  constexpr int kSide = static_cast<int>(kSize);
  constexpr float kSigma_px = kSide / 4.0F;
  for (int i = 0; i < kSide; ++i) {
    const float from_middle = static_cast<float>(i) - 0.5F * kSide;
    const float gaussian = std::exp(-from_middle * from_middle / (2.0F * kSigma_px * kSigma_px));
    for (int cell = 0; cell < 2; ++cell) {
      const float from_cell = (static_cast<float>(i) + 0.5F) / kCell_px - 0.5F - static_cast<float>(cell);
      weights[static_cast<size_t>(cell)][static_cast<size_t>(i)] =
          gaussian * std::max(0.0F, 1.0F - std::abs(from_cell));
    }
  }
  return weights;
}

void normalize(Eigen::Ref<Eigen::VectorXf> block) {
  block *= 1.0F / (block.norm() + kFirstRegularization);
  block = block.cwiseMin(kClip);
  block *= 1.0F / (block.norm() + kSecondRegularization);
}

/// Magnitudes and directions (radians) of the gradients.
void findGradients(const cv::Mat& roots, cv::Mat* magnitude, cv::Mat* direction_rad) {
  cv::Mat dx(roots.size(), CV_32FC1), dy(roots.size(), CV_32FC1);
  const int columns = roots.cols;
  for (int y = 0; y < roots.rows; ++y) {
    const auto* row = roots.ptr<float>(y);
    // Images are mirrored at their borders, where gradients across are none.
    const auto* above = roots.ptr<float>(y > 0 ? y - 1 : 1);
    const auto* below = roots.ptr<float>(y + 1 < roots.rows ? y + 1 : y - 1);
    auto* across = dx.ptr<float>(y);
    auto* down = dy.ptr<float>(y);
    across[0] = across[columns - 1] = 0.0F;
    for (int x = 1; x + 1 < columns; ++x) {
      across[x] = row[x + 1] - row[x - 1];
    }
    for (int x = 0; x < columns; ++x) {
      down[x] = below[x] - above[x];
    }
  }
  cv::cartToPolar(dx, dy, *magnitude, *direction_rad);
}

}  // namespace

PeopleClassifier::PeopleClassifier() : weights_(cellWeights<kBlock_px>()) {
  // OpenCV orders blocks by column, and the cells of a block too.
  const std::vector<float> weights = cv::HOGDescriptor::getDefaultPeopleDetector();
  constexpr int kColumns = kWidth_px / kCell_px - 1, kRows = kHeight_px / kCell_px - 1;
  check(weights.size() == kColumns * kRows * kPerBlock + 1,
        "PeopleClassifier: expected OpenCV's classifier of 64 by 128 pixels");
  for (int row = 0; row < kRows; ++row) {
    for (int column = 0; column < kColumns; ++column) {
      const auto first = weights.begin() + static_cast<std::ptrdiff_t>(column * kRows + row) * kPerBlock;
      by_window_row_.insert(by_window_row_.end(), first, first + kPerBlock);
    }
  }
  offset_ = weights.back();
}

/// Histograms of one row of pixels, by column of blocks and column of cells in the block.
void PeopleClassifier::addPixels(const float* strength, const float* direction_rad, int columns,
                                 float* histograms) const {
  constexpr auto kBinPerRad = static_cast<float>(kBins / M_PI);
  for (int x = 0; x < (columns + 1) * kCell_px; ++x) {
    const float position = direction_rad[x] * kBinPerRad - 0.5F + kBins;  // not negative
    const auto whole = static_cast<int>(position);
    const float high = (position - static_cast<float>(whole)) * strength[x], low = strength[x] - high;
    const int bin = whole % kBins, next = bin + 1 < kBins ? bin + 1 : 0;
    const auto addTo = [&](int block, int cell, int at) {
      const float weight = weights_[static_cast<size_t>(cell)][static_cast<size_t>(at)];
      float* histogram = histograms + (2 * block + cell) * kBins;
      histogram[bin] += weight * low;
      histogram[next] += weight * high;
    };
    // The pixel lies in two blocks, and in the outer halves of blocks only in one of the two cells.
    const int block = x / kCell_px, at = x % kCell_px;
    const bool is_outer = at < kCell_px / 2;
    if (block < columns) {
      addTo(block, 0, at);
      if (!is_outer) {
        addTo(block, 1, at);
      }
    }
    if (block > 0) {
      addTo(block - 1, 1, at + kCell_px);
      if (is_outer) {
        addTo(block - 1, 0, at + kCell_px);
      }
    }
  }
}

/// Adds the histograms of the y-th row of pixels of a row of blocks to its upper and lower cells.
void PeopleClassifier::addRow(const float* histograms, int columns, int y, float* blocks) const {
  for (int cell = 0; cell < 2; ++cell) {
    const float weight = weights_[static_cast<size_t>(cell)][static_cast<size_t>(y)];
    for (int half = 0; weight > 0.0F && half < 2 * columns; ++half) {
      const float* from = histograms + half * kBins;
      float* to = blocks + (2 * half + cell) * kBins;
      for (int bin = 0; bin < kBins; ++bin) {
        to[bin] += weight * from[bin];
      }
    }
  }
}

cv::Mat PeopleClassifier::blocks(const cv::Mat& roots) const {
  const int columns = roots.cols / kCell_px - 1, rows = roots.rows / kCell_px - 1;
  cv::Mat magnitude, direction_rad;
  findGradients(roots, &magnitude, &direction_rad);
  cv::Mat result(rows, columns * kPerBlock, CV_32FC1, cv::Scalar(0.0));
  std::vector<float> histograms(static_cast<size_t>(columns) * 2 * kBins);
  for (int y = 0; y < (rows + 1) * kCell_px; ++y) {
    std::fill(histograms.begin(), histograms.end(), 0.0F);
    addPixels(magnitude.ptr<float>(y), direction_rad.ptr<float>(y), columns, histograms.data());
    // Each row of pixels belongs to two rows of blocks.
    const int last = y / kCell_px;
    for (int block = std::max(0, last - 1); block <= std::min(last, rows - 1); ++block) {
      addRow(histograms.data(), columns, y - block * kCell_px, result.ptr<float>(block));
    }
  }
  for (int row = 0; row < rows; ++row) {
    for (int column = 0; column < columns; ++column) {
      normalize(Eigen::Map<Eigen::VectorXf>(result.ptr<float>(row) + column * kPerBlock, kPerBlock));
    }
  }
  return result;
}

cv::Mat PeopleClassifier::scores(const cv::Mat& roots) const {
  check(roots.type() == CV_32FC1 && roots.cols >= kWidth_px && roots.rows >= kHeight_px,
        "PeopleClassifier: expected CV_32FC1 of at least 64 by 128 pixels");
  static_assert(kStep_px == kCell_px, "windows begin with a block");
  const cv::Mat described = blocks(roots);
  constexpr int kPerRow = (kWidth_px / kCell_px - 1) * kPerBlock, kRows = kHeight_px / kCell_px - 1;
  cv::Mat scores((roots.rows - kHeight_px) / kStep_px + 1, (roots.cols - kWidth_px) / kStep_px + 1, CV_32FC1);
  for (int y = 0; y < scores.rows; ++y) {
    for (int x = 0; x < scores.cols; ++x) {
      float score = offset_;
      for (int row = 0; row < kRows; ++row) {
        using Row = Eigen::Map<const Eigen::VectorXf>;
        score += Row(described.ptr<float>(y + row) + x * kPerBlock, kPerRow)
                     .dot(Row(&by_window_row_[static_cast<size_t>(row) * kPerRow], kPerRow));
      }
      scores.at<float>(y, x) = score;
    }
  }
  return scores;
}

}  // namespace vcharge
