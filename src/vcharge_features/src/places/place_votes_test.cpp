#include "vcharge_features/place_votes.h"

#include <gtest/gtest.h>
#include <tbb/global_control.h>

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <memory>
#include <random>
#include <stdexcept>
#include <utility>
#include <vector>

namespace vcharge {
namespace {

constexpr int kPlaces = 40;
constexpr int kCameras = 2;
constexpr int kFeatures = 60;  ///< features of an image

/// Places that are hard to distinguish: their features are variations of a few kinds, like corners of parked
/// cars. The second camera's kinds differ from the first's.
class AlikePlaces {
 public:
  explicit AlikePlaces(int type) : type_(type) {}

  /// Feature `i` of an image; deterministic.
  cv::Mat feature(int image, int i) const {
    cv::Mat row = kind((image % kCameras) * 100 + i % 6);
    std::mt19937 random(static_cast<unsigned>(1000 * image + i));
    return varied(row, 40, 0.5F, &random);
  }

  /// The image on another day: the given fraction of its features again, slightly changed, and others of the
  /// same kinds.
  cv::Mat onAnotherDay(int image, double fraction_seen_again) const {
    std::mt19937 random(static_cast<unsigned>(5000 + image));
    cv::Mat descriptors;
    for (int i = 0; i < kFeatures; ++i) {
      const bool is_seen_again = i < fraction_seen_again * kFeatures;
      descriptors.push_back(is_seen_again
                                ? varied(feature(image, i), 12, 0.1F, &random)
                                : varied(kind((image % kCameras) * 100 + i % 6), 40, 0.5F, &random));
    }
    return descriptors;
  }

  PlaceVotes votes() const {
    cv::Mat descriptors;
    for (int image = 0; image < kPlaces * kCameras; ++image) {
      for (int i = 0; i < kFeatures; ++i) {
        descriptors.push_back(feature(image, i));
      }
    }
    PlaceSignatures signatures = PlaceSignatures::learnedFrom(descriptors);
    const cv::Mat rows = signatures.of(descriptors);
    std::vector<PlaceFeature> features(static_cast<size_t>(rows.rows));
    for (int i = 0; i < rows.rows; ++i) {
      PlaceFeature& of_row = features[static_cast<size_t>(i)];
      std::copy_n(rows.ptr(i), of_row.signature.size(), of_row.signature.begin());
      of_row.first_place = i / kFeatures / kCameras;
      of_row.camera = i / kFeatures % kCameras;
    }
    return PlaceVotes(std::make_shared<const MemoryPlaceTable>(std::move(features)), std::move(signatures),
                      kPlaces, kCameras);
  }

 private:
  cv::Mat kind(int number) const {
    std::mt19937 random(static_cast<unsigned>(number + 1));
    cv::Mat row(1, type_ == CV_8UC1 ? 32 : 64, type_);
    for (int k = 0; k < row.cols; ++k) {
      if (type_ == CV_8UC1) {
        row.at<uint8_t>(0, k) = static_cast<uint8_t>(random());
      } else {
        row.at<float>(0, k) = static_cast<float>(random() % 1000) / 1000.0F;
      }
    }
    return row;
  }

  cv::Mat varied(const cv::Mat& row, int num_flips, float noise, std::mt19937* random) const {
    cv::Mat changed = row.clone();
    for (int k = 0; type_ == CV_8UC1 && k < num_flips; ++k) {
      const unsigned bit = (*random)() % 256;
      changed.at<uint8_t>(0, static_cast<int>(bit / 8)) ^= static_cast<uint8_t>(1U << (bit % 8));
    }
    for (int k = 0; type_ == CV_32FC1 && k < row.cols; ++k) {
      changed.at<float>(0, k) += noise * (static_cast<float>((*random)() % 1000) / 1000.0F - 0.5F);
    }
    return changed;
  }

  const int type_;
};

class PlaceVotesTest : public ::testing::TestWithParam<int> {};

TEST_P(PlaceVotesTest, FindsThePlaceAmongManyThatLookAlike) {
  const AlikePlaces places(GetParam());
  const PlaceVotes votes = places.votes();
  for (int place = 0; place < kPlaces; place += 3) {
    const std::vector<PlaceMatch> matches = votes.query(
        {places.onAnotherDay(kCameras * place, 0.3), places.onAnotherDay(kCameras * place + 1, 0.3)}, 5);
    ASSERT_FALSE(matches.empty());
    EXPECT_LE(matches.size(), 5U);
    EXPECT_EQ(matches[0].place, place);
    EXPECT_EQ(matches[0].cameras, (std::vector<int>{0, 1}));
  }
}

TEST_P(PlaceVotesTest, AnotherCameraMayHaveSeenIt) {
  const AlikePlaces places(GetParam());
  const PlaceVotes votes = places.votes();
  // The vehicle faces the opposite direction; a third camera is unknown to the places, and one has no
  // features.
  const std::vector<PlaceMatch> matches =
      votes.query({places.onAnotherDay(2 * 7 + 1, 0.5), places.onAnotherDay(2 * 7, 0.5), cv::Mat(),
                   places.onAnotherDay(2 * 7 + 1, 0.5)},
                  1);
  ASSERT_EQ(matches.size(), 1U);
  EXPECT_EQ(matches[0].place, 7);
  EXPECT_EQ(matches[0].cameras, (std::vector<int>{1, 0, -1, 1}));
}

TEST(PlaceVotesRangeTest, AFeatureVotesForAllItsPlacesAndForNoOthers) {
  PlaceFeature feature;
  feature.first_place = 8;
  feature.num_places = 5;  // the table has fewer places
  const PlaceVotes votes(std::make_shared<const MemoryPlaceTable>(std::vector<PlaceFeature>{feature}),
                         PlaceSignatures(cv::Mat()), 10, 1);
  const std::vector<PlaceMatch> matches = votes.query({cv::Mat::zeros(1, 32, CV_8UC1)}, 10);
  ASSERT_EQ(matches.size(), 2U);
  EXPECT_EQ(matches[0].place, 8);
  EXPECT_EQ(matches[1].place, 9);
  EXPECT_FLOAT_EQ(static_cast<float>(matches[0].score), std::log(10.0F / 2.0F));
}

TEST_P(PlaceVotesTest, GivesTheSameOnOneThread) {
  const AlikePlaces places(GetParam());
  const std::vector<cv::Mat> query = {places.onAnotherDay(0, 0.3), places.onAnotherDay(1, 0.3)};
  const std::vector<PlaceMatch> parallel = places.votes().query(query, kPlaces);
  const tbb::global_control one_thread(tbb::global_control::max_allowed_parallelism, 1);
  const std::vector<PlaceMatch> serial = places.votes().query(query, kPlaces);
  ASSERT_EQ(parallel.size(), serial.size());
  for (size_t i = 0; i < serial.size(); ++i) {
    EXPECT_EQ(parallel[i].place, serial[i].place);
    EXPECT_EQ(parallel[i].score, serial[i].score);
  }
}

TEST_P(PlaceVotesTest, NamesBadInput) {
  const AlikePlaces places(GetParam());
  const PlaceVotes votes = places.votes();
  const cv::Mat other_kind =
      cv::Mat::zeros(3, GetParam() == CV_8UC1 ? 64 : 32, GetParam() == CV_8UC1 ? CV_32FC1 : CV_8UC1);
  EXPECT_THROW(votes.query({other_kind}, 5), std::invalid_argument);
  EXPECT_TRUE(votes.query({cv::Mat(), cv::Mat()}, 5).empty());
  const auto table = std::make_shared<const MemoryPlaceTable>(std::vector<PlaceFeature>(1));
  EXPECT_THROW(PlaceVotes(nullptr, PlaceSignatures(cv::Mat()), 1, 1), std::logic_error);
  EXPECT_THROW(PlaceVotes(table, PlaceSignatures(cv::Mat()), 1, 0), std::logic_error);
  PlaceVotesOptions options;
  options.max_distance_bits = -1;
  EXPECT_THROW(PlaceVotes(table, PlaceSignatures(cv::Mat()), 1, 1, options), std::invalid_argument);
}

INSTANTIATE_TEST_SUITE_P(KindsOfDescriptors, PlaceVotesTest, ::testing::Values(CV_8UC1, CV_32FC1),
                         [](const ::testing::TestParamInfo<int>& kind) {
                           return kind.param == CV_8UC1 ? "Binary" : "Numbers";
                         });

}  // namespace
}  // namespace vcharge
