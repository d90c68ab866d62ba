#pragma once

#include <cstdint>
#include <memory>
#include <vector>

#include <opencv2/core.hpp>

#include "vcharge_core/base/options.h"
#include "vcharge_features/place_index.h"
#include "vcharge_features/place_table.h"

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
  /// The table may read a file. Its places are [0, num_places), its cameras [0, num_cameras). Throws
  /// std::logic_error without a table or a camera, std::invalid_argument for bad options.
  PlaceVotes(std::shared_ptr<const PlaceTable> table, PlaceSignatures signatures, int num_places,
             int num_cameras, const PlaceVotesOptions& options = PlaceVotesOptions());

  /// At most `max_results` places with votes, best first, ties by number. The query may have any number of
  /// cameras. The same on any number of threads. Throws std::invalid_argument for descriptors of another
  /// kind, and the errors of the table.
  std::vector<PlaceMatch> query(const std::vector<cv::Mat>& descriptors_by_camera, int max_results) const;

 private:
  struct Hit {
    int32_t first_place, num_places, camera;
    float weight;
  };
  struct Vote {
    int32_t image;  ///< place * number of cameras + camera
    float weight;
  };
  std::vector<std::vector<Hit>> hitsOf(const cv::Mat& signatures) const;
  std::vector<Vote> votesOf(const std::vector<Hit>& hits, std::vector<Vote>* best_of_place) const;

  const std::shared_ptr<const PlaceTable> table_;
  const PlaceSignatures signatures_;
  const int num_places_, num_cameras_;
  const PlaceVotesOptions options_;
};

}  // namespace vcharge
