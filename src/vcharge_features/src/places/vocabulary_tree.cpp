#include "vcharge_features/vocabulary_tree.h"

#include <tbb/parallel_for.h>

#include <algorithm>
#include <cmath>
#include <numeric>
#include <set>
#include <stdexcept>

#include "matching/descriptor_kernels.h"
#include "matching/matching_internal.h"
#include "places/descriptor_clustering.h"

namespace vcharge {
namespace {

/// A node whose members must still be clustered.
struct OpenNode {
  size_t node;
  std::vector<int32_t> members;
};

/// Differs between nodes and does not depend on the order of processing.
uint64_t seedOf(size_t node) {
  constexpr uint64_t kSeed = 1;
  return (kSeed << 32) ^ static_cast<uint64_t>(node);
}

cv::Mat joinDescriptors(const std::vector<cv::Mat>& descriptors_of_images) {
  cv::Mat all;
  for (const cv::Mat& descriptors : descriptors_of_images) {
    if (descriptors.rows == 0) {
      continue;
    }
    checkDescriptors(descriptors, "VocabularyTree::train", "descriptors_of_images");
    if (!all.empty() && (descriptors.type() != all.type() || descriptors.cols != all.cols)) {
      throw std::invalid_argument(
          "VocabularyTree::train: descriptors_of_images: expected descriptors of one kind, got " +
          cv::typeToString(all.type()) + " and " + cv::typeToString(descriptors.type()));
    }
    all.push_back(descriptors);
  }
  if (all.empty()) {
    throw std::invalid_argument("VocabularyTree::train: descriptors_of_images: there are no descriptors");
  }
  return all;
}

}  // namespace

VocabularyTree VocabularyTree::train(const std::vector<cv::Mat>& descriptors_of_images,
                                     const VocabularyTreeOptions& options) {
  options.validate();
  const cv::Mat all = joinDescriptors(descriptors_of_images);
  VocabularyTree tree;
  tree.nodes_.emplace_back();
  tree.centres_ = cv::Mat::zeros(1, all.cols, all.type());
  std::vector<OpenNode> open(1);
  open[0].node = 0;
  open[0].members.resize(static_cast<size_t>(all.rows));
  std::iota(open[0].members.begin(), open[0].members.end(), 0);
  for (int level = 0; level < options.depth && !open.empty(); ++level) {
    std::vector<DescriptorClusters> clusters(open.size());
    tbb::parallel_for(size_t{0}, open.size(), [&](size_t i) {
      clusters[i] = clusterDescriptors(all, open[i].members, options.branching, options.max_iterations,
                                       seedOf(open[i].node));
    });
    std::vector<OpenNode> next;
    for (size_t i = 0; i < open.size(); ++i) {
      const size_t num_children = clusters[i].members.size();
      if (num_children < 2) {
        continue;  // all descriptors are equal, so the node is a leaf
      }
      tree.nodes_[open[i].node].first_child = static_cast<int32_t>(tree.nodes_.size());
      tree.nodes_[open[i].node].num_children = static_cast<int32_t>(num_children);
      tree.centres_.push_back(clusters[i].centres);
      for (std::vector<int32_t>& members : clusters[i].members) {
        // Smaller clusters would give each descriptor its own word, which is useless.
        if (members.size() > static_cast<size_t>(options.branching)) {
          next.push_back({tree.nodes_.size(), std::move(members)});
        }
        tree.nodes_.emplace_back();
      }
    }
    open = std::move(next);
  }
  tree.addLeaves();
  tree.setWeights(descriptors_of_images);
  return tree;
}

void VocabularyTree::addLeaves() {
  int32_t word = 0;
  for (Node& node : nodes_) {
    node.word = node.num_children == 0 ? word++ : -1;
  }
  word_weights_.assign(static_cast<size_t>(word), 0.0F);
}

void VocabularyTree::setWeights(const std::vector<cv::Mat>& descriptors_of_images) {
  std::vector<int> images_with_word(word_weights_.size(), 0);
  for (const cv::Mat& descriptors : descriptors_of_images) {
    const std::vector<int32_t> found = words(descriptors);
    for (const int32_t word : std::set<int32_t>(found.begin(), found.end())) {
      ++images_with_word[word];
    }
  }
  for (size_t i = 0; i < word_weights_.size(); ++i) {
    // A word without descriptors (its cluster moved away) counts as observed once.
    word_weights_[i] = static_cast<float>(
        std::log(static_cast<double>(descriptors_of_images.size()) / std::max(images_with_word[i], 1)));
  }
}

std::vector<int32_t> VocabularyTree::words(const cv::Mat& descriptors) const {
  std::vector<int32_t> found(static_cast<size_t>(descriptors.rows));
  if (descriptors.rows == 0) {
    return found;
  }
  checkDescriptors(descriptors, "VocabularyTree", "descriptors");
  if (descriptors.type() != centres_.type() || descriptors.cols != centres_.cols) {
    throw std::invalid_argument("VocabularyTree: descriptors: expected " + cv::typeToString(centres_.type()) +
                                " with " + std::to_string(centres_.cols) +
                                " columns, as the vocabulary's, got " + cv::typeToString(descriptors.type()) +
                                " with " + std::to_string(descriptors.cols));
  }
  const bool binary = descriptors.type() == CV_8UC1;
  std::vector<float> distances;
  for (int i = 0; i < descriptors.rows; ++i) {
    const Node* node = &nodes_[0];
    while (node->num_children > 0) {
      const auto count = static_cast<size_t>(node->num_children);
      distances.resize(count);
      if (binary) {
        hammingToRows(descriptors.ptr(i), centres_.ptr(node->first_child), centres_.step, nullptr, count,
                      distances.data());
      } else {
        squaredDistanceToRows(descriptors.ptr<float>(i), static_cast<size_t>(descriptors.cols),
                              centres_.ptr<float>(node->first_child), centres_.step1(), nullptr, count,
                              distances.data());
      }
      const auto nearest = std::min_element(distances.begin(), distances.end()) - distances.begin();
      node = &nodes_[static_cast<size_t>(node->first_child + nearest)];
    }
    found[i] = node->word;
  }
  return found;
}

BagOfWords VocabularyTree::bagOfWords(const cv::Mat& descriptors) const {
  std::vector<int32_t> found = words(descriptors);
  std::sort(found.begin(), found.end());
  BagOfWords bag;
  double sum = 0.0;
  for (const int32_t word : found) {
    const float weight = word_weights_[word];
    if (weight > 0.0F) {
      if (bag.empty() || bag.back().word != word) {
        bag.push_back({word, 0.0F});
      }
      bag.back().weight += weight;
      sum += weight;
    }
  }
  for (WeightedWord& entry : bag) {
    entry.weight = static_cast<float>(entry.weight / sum);
  }
  return bag;
}

double bagOfWordsSimilarity(const BagOfWords& a, const BagOfWords& b) {
  // For weights that add up to 1, |a - b|_1 / 2 is 1 minus the common weight.
  double common = 0.0;
  for (auto i = a.begin(), j = b.begin(); i != a.end() && j != b.end();) {
    if (i->word == j->word) {
      common += std::min(i->weight, j->weight);
      ++i;
      ++j;
    } else if (i->word < j->word) {
      ++i;
    } else {
      ++j;
    }
  }
  return common;
}

}  // namespace vcharge
