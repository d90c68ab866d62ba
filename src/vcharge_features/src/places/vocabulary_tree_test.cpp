#include "vcharge_features/vocabulary_tree.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <tbb/global_control.h>

#include <cmath>
#include <random>
#include <set>
#include <utility>

#include "vcharge_features/place_index.h"

namespace vcharge {
namespace {

using ::testing::HasSubstr;
using ::testing::ThrowsMessage;

constexpr int kNumTopics = 60;

/// Descriptors around kNumTopics distant centres ("topics"), which a vocabulary should find.
cv::Mat descriptorsOf(const std::vector<int>& topics, int type, unsigned seed) {
  cv::Mat descriptors(0, type == CV_8UC1 ? 32 : 64, type);
  std::mt19937 noise(seed);
  for (const int topic : topics) {
    std::mt19937 generator(static_cast<unsigned>(1000 + topic));
    cv::Mat row(1, descriptors.cols, type);
    for (int k = 0; k < row.cols; ++k) {
      if (type == CV_8UC1) {
        row.at<uint8_t>(0, k) = static_cast<uint8_t>(generator());
      } else {
        row.at<float>(0, k) = static_cast<float>(generator() % 200 + noise() % 10);
      }
    }
    for (int flip = 0; type == CV_8UC1 && flip < 8; ++flip) {
      const unsigned bit = noise() % 256;
      row.at<uint8_t>(0, static_cast<int>(bit / 8)) ^= static_cast<uint8_t>(1U << (bit % 8));
    }
    descriptors.push_back(row);
  }
  return descriptors;
}

/// Twelve of the sixty topics per image.
std::vector<int> topicsOfImage(int image) {
  std::mt19937 generator(static_cast<unsigned>(image));
  std::vector<int> topics;
  for (int i = 0; i < 12; ++i) {
    topics.push_back(static_cast<int>(generator() % kNumTopics));
  }
  return topics;
}

class VocabularyTreeTest : public ::testing::TestWithParam<int> {
 protected:
  static std::vector<cv::Mat> trainingImages(int count = 80) {
    std::vector<cv::Mat> images;
    for (int i = 0; i < count; ++i) {
      images.push_back(descriptorsOf(topicsOfImage(i), GetParam(), static_cast<unsigned>(i)));
    }
    return images;
  }
  static VocabularyTreeOptions options() {
    VocabularyTreeOptions options;
    // About as many words as topics: more words would split topics by their noise.
    options.branching = 8;
    options.depth = 2;
    return options;
  }
};

TEST_P(VocabularyTreeTest, GivesDescriptorsOfOneTopicOneWord) {
  const VocabularyTree tree = VocabularyTree::train(trainingImages(), options());
  EXPECT_GT(tree.numWords(), kNumTopics / 2);
  EXPECT_LE(tree.numWords(), 64);
  EXPECT_EQ(tree.descriptorType(), GetParam());
  std::set<int32_t> different;
  int same = 0;
  for (int topic = 0; topic < kNumTopics; ++topic) {
    const std::vector<int32_t> words =
        tree.words(descriptorsOf({topic, topic, topic, topic}, GetParam(), 7777));
    same += std::set<int32_t>(words.begin(), words.end()).size() == 1 ? 1 : 0;
    different.insert(words[0]);
  }
  // Some clusters contain part of a topic or two topics.
  EXPECT_GT(same, 0.8 * kNumTopics);
  EXPECT_GT(different.size(), 0.6 * kNumTopics);
}

TEST_P(VocabularyTreeTest, FindsThePlaceOfEachImageAgain) {
  const auto tree =
      std::make_shared<const VocabularyTree>(VocabularyTree::train(trainingImages(), options()));
  PlaceIndex index(tree, 1);
  for (int i = 0; i < 200; ++i) {
    EXPECT_EQ(index.add({descriptorsOf(topicsOfImage(i), GetParam(), 5000U + static_cast<unsigned>(i))}), i);
  }
  int right = 0;
  for (int i = 0; i < 200; ++i) {
    const auto matches =
        index.query({descriptorsOf(topicsOfImage(i), GetParam(), 9000U + static_cast<unsigned>(i))}, 3);
    right += !matches.empty() && matches[0].place == i ? 1 : 0;
  }
  EXPECT_GT(right, 180);
}

TEST_P(VocabularyTreeTest, IsTheSameOnAnyNumberOfThreads) {
  const std::vector<cv::Mat> images = trainingImages();
  const auto wordsAndWeights = [&](const VocabularyTree& tree) {
    std::vector<std::pair<int32_t, float>> result;
    for (const cv::Mat& image : images) {
      for (const WeightedWord& word : tree.bagOfWords(image)) {
        result.emplace_back(word.word, word.weight);
      }
    }
    return result;
  };
  std::vector<std::pair<int32_t, float>> expected;
  for (const int threads : {1, 4}) {
    const tbb::global_control limit(tbb::global_control::max_allowed_parallelism, threads);
    const auto result = wordsAndWeights(VocabularyTree::train(images, options()));
    expected = threads == 1 ? result : expected;
    EXPECT_EQ(result, expected);
  }
  VocabularyTreeOptions other = options();
  other.max_iterations = 1;
  EXPECT_NE(wordsAndWeights(VocabularyTree::train(images, other)), expected);
}

INSTANTIATE_TEST_SUITE_P(Kinds, VocabularyTreeTest, ::testing::Values(CV_8UC1, CV_32FC1),
                         [](const auto& parameter) {
                           return parameter.param == CV_8UC1 ? "bits" : "numbers";
                         });

TEST(VocabularyTreeErrorTest, BadInputIsNamed) {
  const auto throwing = [](const char* text) {
    return ThrowsMessage<std::invalid_argument>(HasSubstr(text));
  };
  const cv::Mat bits = descriptorsOf({1, 2, 3}, CV_8UC1, 1);
  const cv::Mat numbers = descriptorsOf({1, 2, 3}, CV_32FC1, 1);
  EXPECT_THAT([&] { VocabularyTree::train({}); }, throwing("no descriptors"));
  EXPECT_THAT([&] { VocabularyTree::train({cv::Mat()}); }, throwing("no descriptors"));
  EXPECT_THAT([&] { VocabularyTree::train({bits, numbers}); }, throwing("of one kind"));
  cv::Mat broken = numbers.clone();
  broken.at<float>(0, 0) = NAN;
  EXPECT_THAT([&] { VocabularyTree::train({broken}); }, throwing("finite"));
  VocabularyTreeOptions options;
  options.branching = 1;
  EXPECT_THAT([&] { VocabularyTree::train({bits}, options); }, throwing("branching"));
  const auto tree = std::make_shared<const VocabularyTree>(VocabularyTree::train({bits, bits}));
  EXPECT_THAT([&] { tree->words(numbers); }, throwing("descriptors: expected CV_8UC1"));
  EXPECT_TRUE(tree->words(cv::Mat()).empty());
  EXPECT_THROW(PlaceIndex(nullptr, 1), std::logic_error);
  EXPECT_THROW(PlaceIndex(tree, 0), std::logic_error);
  PlaceIndex index(tree, 2);
  EXPECT_THROW(index.add({bits}), std::logic_error);
  EXPECT_THAT([&] { index.add({bits, numbers}); }, throwing("descriptors"));
  EXPECT_THROW(index.addAll({{bits, bits}, {bits}}), std::logic_error);
  EXPECT_THAT([&] { index.addAll({{bits, bits}, {bits, numbers}}); }, throwing("descriptors"));
  EXPECT_EQ(index.numPlaces(), 0) << "nothing half added";
}

TEST(VocabularyTreeErrorTest, EqualDescriptorsAreOneWordThatTellsNothing) {
  const cv::Mat equal = cv::Mat::zeros(50, 32, CV_8UC1);
  const VocabularyTree tree = VocabularyTree::train({equal, equal});
  EXPECT_EQ(tree.numWords(), 1);
  EXPECT_TRUE(tree.bagOfWords(equal).empty());
}

TEST(BagOfWordsTest, SimilarityIsOneLessHalfTheL1Distance) {
  const BagOfWords a = {{0, 0.5F}, {3, 0.25F}, {7, 0.25F}};
  const BagOfWords b = {{3, 0.5F}, {7, 0.125F}, {9, 0.375F}};
  EXPECT_NEAR(bagOfWordsSimilarity(a, b), 1.0 - 0.5 * (0.5 + 0.25 + 0.125 + 0.375), 1e-7);
  EXPECT_NEAR(bagOfWordsSimilarity(a, a), 1.0, 1e-7);
  EXPECT_EQ(bagOfWordsSimilarity(a, {}), 0.0);
}

TEST(BagOfWordsTest, WeightsAreTermTimesInverseDocumentFrequency) {
  // Topic 0 is in both images, topic 1 only in the first, topic 2 only in the second.
  const std::vector<cv::Mat> images = {descriptorsOf({0, 0, 1, 1, 1}, CV_32FC1, 1),
                                       descriptorsOf({0, 2}, CV_32FC1, 2)};
  VocabularyTreeOptions options;
  options.branching = 3;
  options.depth = 1;
  const VocabularyTree tree = VocabularyTree::train(images, options);
  ASSERT_EQ(tree.numWords(), 3);
  // Weights: ln(2/2) = 0 for topic 0, ln(2/1) for the others, of which two of three are topic 1.
  const BagOfWords bag = tree.bagOfWords(descriptorsOf({0, 1, 2, 1}, CV_32FC1, 3));
  ASSERT_EQ(bag.size(), 2U);
  EXPECT_NEAR(std::max(bag[0].weight, bag[1].weight), 2.0 / 3.0, 1e-6);
  EXPECT_NEAR(std::min(bag[0].weight, bag[1].weight), 1.0 / 3.0, 1e-6);
}

TEST(PlaceIndexTest, ScoreAddsTheMostSimilarCamerasAndIsThatOfTheBags) {
  std::vector<cv::Mat> training;
  for (int i = 0; i < 40; ++i) {
    training.push_back(descriptorsOf(topicsOfImage(i), CV_8UC1, static_cast<unsigned>(i)));
  }
  const auto tree = std::make_shared<const VocabularyTree>(VocabularyTree::train(training));
  const auto image = [](int i) {
    return descriptorsOf(topicsOfImage(i), CV_8UC1, 100U + static_cast<unsigned>(i));
  };
  PlaceIndex index(tree, 2);
  index.add({image(1), image(2)});
  index.add({image(3), cv::Mat()});
  index.add({image(5), image(6)});
  // In the opposite direction, the second camera observes what the first one did.
  const auto matches = index.query({image(6), image(5)}, 10);
  ASSERT_FALSE(matches.empty());
  EXPECT_EQ(matches[0].place, 2);
  EXPECT_NEAR(matches[0].score, 2.0, 1e-5);
  EXPECT_THAT(matches[0].cameras, ::testing::ElementsAre(1, 0));
  for (const PlaceMatch& match : index.query({image(2), image(9)}, 10)) {
    const int stored[3][2] = {{1, 2}, {3, -1}, {5, 6}};
    double expected = 0.0;
    for (const int query : {2, 9}) {
      double best = 0.0;
      for (const int other : stored[match.place]) {
        const BagOfWords bag = other < 0 ? BagOfWords() : tree->bagOfWords(image(other));
        best = std::max(best, bagOfWordsSimilarity(tree->bagOfWords(image(query)), bag));
      }
      expected += best;
    }
    EXPECT_NEAR(match.score, expected, 1e-6);
  }
  EXPECT_EQ(index.query({image(6), image(5)}, 1).size(), 1U);
  EXPECT_TRUE(index.query({image(6), image(5)}, 10, 0).empty());
  for (const PlaceMatch& match : index.query({image(6), image(5)}, 10, 2)) {
    EXPECT_LT(match.place, 2);
  }
  EXPECT_TRUE(index.query({cv::Mat(), cv::Mat()}, 10).empty());
}

TEST(PlaceIndexTest, AddingAllAtOnceIsAddingOneByOne) {
  std::vector<std::vector<cv::Mat>> places;
  std::vector<cv::Mat> training;
  for (int i = 0; i < 40; ++i) {
    training.push_back(descriptorsOf(topicsOfImage(i), CV_8UC1, static_cast<unsigned>(i)));
    places.push_back({training.back(), i % 3 == 0 ? cv::Mat() : training[static_cast<size_t>(i / 2)]});
  }
  const auto tree = std::make_shared<const VocabularyTree>(VocabularyTree::train(training));
  PlaceIndex one_by_one(tree, 2), at_once(tree, 2);
  for (const std::vector<cv::Mat>& place : places) {
    one_by_one.add(place);
  }
  EXPECT_EQ(at_once.addAll({places.begin(), places.begin() + 15}), 0);
  EXPECT_EQ(at_once.addAll({places.begin() + 15, places.end()}), 15);
  EXPECT_EQ(at_once.addAll({}), 40);
  EXPECT_EQ(at_once.numPlaces(), one_by_one.numPlaces());
  for (int i = 0; i < 40; ++i) {
    const std::vector<cv::Mat> seen = {training[static_cast<size_t>(39 - i)],
                                       training[static_cast<size_t>(i)]};
    const std::vector<PlaceMatch> expected = one_by_one.query(seen, 40), found = at_once.query(seen, 40);
    ASSERT_FALSE(expected.empty());
    ASSERT_EQ(found.size(), expected.size());
    for (size_t k = 0; k < found.size(); ++k) {
      EXPECT_EQ(found[k].place, expected[k].place);
      EXPECT_EQ(found[k].score, expected[k].score);
      EXPECT_EQ(found[k].cameras, expected[k].cameras);
    }
  }
}

}  // namespace
}  // namespace vcharge
