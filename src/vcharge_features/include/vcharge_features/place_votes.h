#pragma once

#include <cstdint>
#include <memory>
#include <vector>

#include <opencv2/core.hpp>

#include "vcharge_core/base/options.h"
#include "vcharge_features/hamming_index.h"
#include "vcharge_features/place_index.h"

namespace vcharge {

struct PlaceVotesOptions {
  VCHARGE_BEGIN_OPTIONS(PlaceVotesOptions);
  VCHARGE_OPTION(int, max_distance_bits, 32, between(0, 256),
                 "Largest distance between a feature and one that it votes for.");
  VCHARGE_OPTION(double, sigma_bits, 20.0, positive(),
                 "Standard deviation of the normal distribution that weights a vote by its distance.");
  VCHARGE_END_OPTIONS();
};

/// Recognizes places of a map, also on another day, by single features: each votes for the places that have
/// nearly the same feature, with less weight the more places have it (ln(N / n), inverse document frequency).
/// Features are not quantized: in repetitive scenes such as parked cars and marked bays, the words of a
/// vocabulary tree are the same everywhere, and PlaceIndex, which is faster and can grow, ranks the right
/// place behind many others. Immutable.
class PlaceVotes {
 public:
  /// Descriptor i belongs to image images[i] = place * num_cameras + camera. Descriptors of numbers are
  /// compared by 256 bits, each of which says which of two numbers is larger. Throws std::logic_error for
  /// inconsistent counts or images, std::invalid_argument for bad options or descriptors.
  PlaceVotes(const cv::Mat& descriptors, std::vector<int32_t> images, int num_places, int num_cameras,
             const PlaceVotesOptions& options = PlaceVotesOptions());

  /// At most `max_results` places with votes, best first, ties by number. The query may have any number of
  /// cameras. The same on any number of threads. Throws std::invalid_argument for descriptors of another
  /// kind.
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
  cv::Mat mean_;  // mean descriptor, for descriptors of numbers
  std::unique_ptr<HammingIndex> index_;
};

}  // namespace vcharge
