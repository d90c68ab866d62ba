#pragma once

#include <cstdint>
#include <string>
#include <vector>

#include <opencv2/core.hpp>

#include "vcharge_core/base/options.h"

namespace vcharge {

struct VocabularyTreeOptions {
  VCHARGE_BEGIN_OPTIONS(VocabularyTreeOptions);
  VCHARGE_OPTION(int, branching, 10, between(2, 1000), "Largest number of children of a node.");
  VCHARGE_OPTION(int, depth, 4, between(1, 20), "Levels below the root: at most branching^depth words.");
  VCHARGE_OPTION(int, max_iterations, 10, between(1, 1000),
                 "Largest number of iterations to cluster a node.");
  VCHARGE_END_OPTIONS();
};

/// A word of the vocabulary and its weight.
struct WeightedWord {
  int32_t word = 0;
  float weight = 0.0F;
};

/// The words of an image in ascending order, each once, with positive weights that add up to 1. Empty if no
/// word distinguishes images.
using BagOfWords = std::vector<WeightedWord>;

/// Quantizes descriptors by hierarchical clustering (Nister and Stewenius, CVPR 2006): k-means for CV_32FC1,
/// k-medians by the majority of each bit for binary descriptors. The leaves are the words, weighted by the
/// inverse document frequency ln(N / N_w), where N_w of the N training images contain the word. Immutable.
class VocabularyTree {
 public:
  /// Expects a matrix of descriptors per training image, all of one kind; empty ones count as images without
  /// words. The same input gives the same tree on any number of threads. Throws std::invalid_argument for bad
  /// options, no descriptors at all, or descriptors that findDescriptorNeighbours() rejects.
  static VocabularyTree train(const std::vector<cv::Mat>& descriptors_of_images,
                              const VocabularyTreeOptions& options = VocabularyTreeOptions());

  int numWords() const { return static_cast<int>(word_weights_.size()); }
  int descriptorType() const { return centres_.type(); }
  int descriptorColumns() const { return centres_.cols; }

  /// Word of each descriptor. Throws std::invalid_argument for descriptors of another kind.
  std::vector<int32_t> words(const cv::Mat& descriptors) const;
  /// Term frequency times inverse document frequency, scaled to a sum of 1. Throws like words().
  BagOfWords bagOfWords(const cv::Mat& descriptors) const;

 private:
  /// Children are consecutive nodes; a leaf has a word instead.
  struct Node {
    int32_t first_child = 0;
    int32_t num_children = 0;
    int32_t word = -1;
  };
  VocabularyTree() = default;
  void addLeaves();
  void setWeights(const std::vector<cv::Mat>& descriptors_of_images);

  std::vector<Node> nodes_;  ///< the root is the first; children come after their parents
  cv::Mat centres_;          ///< row i: centre of node i (the root's is zero)
  std::vector<float> word_weights_;
};

/// 1 for equal bags, 0 for bags without a common word: 1 - |a - b|_1 / 2 (Nister and Stewenius, eq. 4).
double bagOfWordsSimilarity(const BagOfWords& a, const BagOfWords& b);

}  // namespace vcharge
