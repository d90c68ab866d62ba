#pragma once

#include <cstdint>
#include <string>
#include <vector>

#include <opencv2/core.hpp>

#include "vcharge_core/base/options.h"

namespace vcharge {

struct VocabularyTreeOptions {
  int branching = 10;       ///< children of a node, at most
  int depth = 4;            ///< levels below the root: at most branching^depth words
  int max_iterations = 10;  ///< of the clustering of one node
  int seed = 1;

  template <class Visitor>
  void visitFields(Visitor&& visit) {
    visit("branching", branching);
    visit("depth", depth);
    visit("max_iterations", max_iterations);
    visit("seed", seed);
  }
  void validate() const;  ///< throws std::invalid_argument naming the field
};

/// A word of the vocabulary and its weight.
struct WeightedWord {
  int32_t word = 0;
  float weight = 0.0F;
};

/// The words of an image in ascending order, each once, with positive weights that add up to 1 (empty where
/// no word tells images apart).
using BagOfWords = std::vector<WeightedWord>;

/// Quantizes descriptors by hierarchical clustering (Nister and Stewenius, CVPR 2006): k-means for CV_32FC1,
/// k-medians by the majority of each bit for binary descriptors. The leaves are the words, weighted by the
/// inverse document frequency ln(N / N_w) over the N training images, N_w of which hold the word. Immutable.
class VocabularyTree {
 public:
  /// One matrix of descriptors per training image, all of one kind; empty ones count as images without
  /// words. The same input gives the same tree on any number of threads. std::invalid_argument for bad
  /// options, no descriptors at all, or descriptors that findDescriptorNeighbours() would not take.
  static VocabularyTree train(const std::vector<cv::Mat>& descriptors_of_images,
                              const VocabularyTreeOptions& options = VocabularyTreeOptions());

  /// Reads what write() wrote. InputError naming the file when it is missing, truncated, corrupt, of another
  /// version, or no vocabulary.
  static VocabularyTree read(const std::string& path);
  /// Replaces the file only once it is complete. InputError when it cannot be written.
  void write(const std::string& path) const;
  /// The bytes of such a file, to be kept inside another; `source` names them in errors, as a path does.
  std::string serialize() const;
  static VocabularyTree parse(const std::string& text, const std::string& source);

  int numWords() const { return static_cast<int>(word_weights_.size()); }
  int descriptorType() const { return centres_.type(); }
  int descriptorColumns() const { return centres_.cols; }

  /// Word of each descriptor. std::invalid_argument for descriptors of another kind than the vocabulary's.
  std::vector<int32_t> words(const cv::Mat& descriptors) const;
  /// Term frequency times inverse document frequency, scaled to a sum of 1. Errors as words().
  BagOfWords bagOfWords(const cv::Mat& descriptors) const;

 private:
  /// Children are consecutive nodes; a leaf has none, and a word.
  struct Node {
    int32_t first_child = 0;
    int32_t num_children = 0;
    int32_t word = -1;
  };
  VocabularyTree() = default;
  void addLeaves();
  void setWeights(const std::vector<cv::Mat>& descriptors_of_images);
  bool isValid() const;

  std::vector<Node> nodes_;  ///< the root is the first; children come after their parents
  cv::Mat centres_;          ///< row i: centre of node i (the root's is zero)
  std::vector<float> word_weights_;
};

/// 1 for equal bags, 0 for bags without a common word: 1 - |a - b|_1 / 2 (Nister and Stewenius, eq. 4).
double bagOfWordsSimilarity(const BagOfWords& a, const BagOfWords& b);

}  // namespace vcharge
