#pragma once

#include <cstdint>
#include <memory>
#include <vector>

#include <opencv2/core.hpp>

#include "vcharge_features/hamming_index.h"
#include "vcharge_features/place_index.h"

namespace vcharge {

struct PlaceVotesOptions {
  int max_distance_bits = 32;  ///< between a feature and what it votes for
  double sigma_bits = 20.0;    ///< a vote's weight falls off as a normal distribution of the distance
  HammingIndexOptions index;

  template <class Visitor>
  void visitFields(Visitor&& visit) {
    visit("max_distance_bits", max_distance_bits);
    visit("sigma_bits", sigma_bits);
    visit("index", index);
  }
  void validate() const;  ///< throws std::invalid_argument naming the field
};

/// Finds places of a map again, on another day too, by single features: each votes for the places where
/// nearly the same was seen, the less the more places there are (ln(N / n), inverse document frequency).
/// Nothing is quantized, so what only resembles adds nothing: where much of a scene looks alike, as parked
/// cars and marked bays do, the words of a vocabulary tree are the same everywhere, and PlaceIndex (which is
/// faster, and grows) ranks the right place behind many others. Immutable.
class PlaceVotes {
 public:
  /// Descriptor i was seen in image images[i] = place * num_cameras + camera. Numbers are compared by 256
  /// bits that tell which of two of them is larger. std::logic_error for counts or images that do not fit;
  /// std::invalid_argument for bad options or descriptors.
  PlaceVotes(const cv::Mat& descriptors, std::vector<int32_t> images, int num_places, int num_cameras,
             const PlaceVotesOptions& options = PlaceVotesOptions());

  /// At most `max_results` places with a vote, the best first, ties by number. The query may have any number
  /// of cameras. The same on any number of threads. std::invalid_argument for descriptors of another kind.
  std::vector<PlaceMatch> query(const std::vector<cv::Mat>& descriptors_by_camera, int max_results) const;

 private:
  struct Vote {
    int32_t image;
    float weight;
  };
  cv::Mat signaturesOf(const cv::Mat& descriptors) const;
  std::vector<Vote> votesOf(const uint8_t* signature, std::vector<Vote>* best_of_place) const;

  const PlaceVotesOptions options_;
  const int num_places_, num_cameras_;
  const int type_, columns_;
  const std::vector<int32_t> images_;
  cv::Mat mean_;  // of descriptors that are numbers
  std::unique_ptr<HammingIndex> index_;
};

}  // namespace vcharge
