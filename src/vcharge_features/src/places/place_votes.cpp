#include "vcharge_features/place_votes.h"

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <stdexcept>
#include <utility>

#include <tbb/parallel_for.h>

#include "matching/binary_signature.h"
#include "matching/matching_internal.h"
#include "places/place_ranking.h"
#include "vcharge_core/base/error.h"

namespace vcharge {
namespace {

/// Number of features that a thread processes at a time.
constexpr int kBlock = 64;

}  // namespace

PlaceVotes::PlaceVotes(const cv::Mat& descriptors, std::vector<int32_t> images, int num_places,
                       int num_cameras, const PlaceVotesOptions& options)
    : options_((options.validate(), options)),
      num_places_(num_places),
      num_cameras_(num_cameras),
      type_(descriptors.type()),
      columns_(descriptors.cols),
      images_(std::move(images)) {
  check(images_.size() == static_cast<size_t>(descriptors.rows), "PlaceVotes: one image per descriptor");
  check(num_places >= 0 && num_cameras >= 1, "PlaceVotes: needs at least one camera");
  const int64_t num_images = int64_t{num_places} * num_cameras;
  check(std::all_of(images_.begin(), images_.end(),
                    [&](int32_t image) { return image >= 0 && image < num_images; }),
        "PlaceVotes: images out of range");
  const bool is_binary = descriptors.rows == 0 || checkDescriptors(descriptors, "PlaceVotes", "descriptors");
  if (!is_binary) {
    mean_ = meanDescriptor(descriptors);
  }
  index_ = std::make_unique<HammingIndex>(signaturesOf(descriptors));
}

cv::Mat PlaceVotes::signaturesOf(const cv::Mat& descriptors) const {
  return mean_.empty() ? descriptors : binarySignatures(descriptors, mean_);
}

std::vector<PlaceVotes::Vote> PlaceVotes::votesOf(const uint8_t* signature,
                                                  std::vector<Vote>* best_of_place) const {
  // Only the nearest feature of each place votes, so repeated structure counts once per place.
  std::vector<int32_t> places;
  for (const DescriptorNeighbour& neighbour : index_->near(signature, options_.max_distance_bits)) {
    const int32_t image = images_[static_cast<size_t>(neighbour.index)];
    const int32_t place = image / num_cameras_;
    Vote& best = (*best_of_place)[static_cast<size_t>(place)];
    const double distance = neighbour.distance / options_.sigma_bits;
    const auto weight = static_cast<float>(std::exp(-0.5 * distance * distance));
    if (best.image < 0) {
      places.push_back(place);
    }
    if (best.image < 0 || weight > best.weight) {
      best = {image, weight};
    }
  }
  std::vector<Vote> votes;
  const auto rarity = static_cast<float>(
      std::log(static_cast<double>(num_places_) / static_cast<double>(std::max<size_t>(1, places.size()))));
  for (const int32_t place : places) {
    Vote& best = (*best_of_place)[static_cast<size_t>(place)];
    votes.push_back({best.image, rarity * best.weight});
    best.image = -1;
  }
  return votes;
}

std::vector<PlaceMatch> PlaceVotes::query(const std::vector<cv::Mat>& descriptors_by_camera,
                                          int max_results) const {
  const size_t num_query_cameras = descriptors_by_camera.size();
  std::vector<PlaceMatch> matches(static_cast<size_t>(num_places_));
  for (int i = 0; i < num_places_; ++i) {
    matches[static_cast<size_t>(i)].place = i;
    matches[static_cast<size_t>(i)].cameras.assign(num_query_cameras, -1);
  }
  std::vector<double> of_image(static_cast<size_t>(num_places_) * static_cast<size_t>(num_cameras_));
  for (size_t camera = 0; camera < num_query_cameras; ++camera) {
    const cv::Mat& descriptors = descriptors_by_camera[camera];
    if (descriptors.rows == 0) {
      continue;
    }
    if (descriptors.type() != type_ || descriptors.cols != columns_) {
      throw std::invalid_argument("PlaceVotes: expected descriptors of the places' kind");
    }
    const cv::Mat signatures = signaturesOf(descriptors);
    std::vector<std::vector<Vote>> votes(static_cast<size_t>(signatures.rows));
    const int num_blocks = (signatures.rows + kBlock - 1) / kBlock;
    tbb::parallel_for(0, num_blocks, [&](int block) {
      std::vector<Vote> best_of_place(static_cast<size_t>(num_places_), Vote{-1, 0.0F});
      const int end = std::min(signatures.rows, (block + 1) * kBlock);
      for (int i = block * kBlock; i < end; ++i) {
        votes[static_cast<size_t>(i)] = votesOf(signatures.ptr(i), &best_of_place);
      }
    });
    // Sums in a fixed order, so the result does not depend on the number of threads.
    std::fill(of_image.begin(), of_image.end(), 0.0);
    for (const std::vector<Vote>& of_feature : votes) {
      for (const Vote& vote : of_feature) {
        of_image[static_cast<size_t>(vote.image)] += vote.weight;
      }
    }
    for (PlaceMatch& match : matches) {
      const auto first = of_image.begin() + static_cast<ptrdiff_t>(match.place) * num_cameras_;
      for (auto image = first; image != first + num_cameras_; ++image) {
        match.score += *image;
      }
      const auto best = std::max_element(first, first + num_cameras_);
      if (*best > 0.0) {
        match.cameras[camera] = static_cast<int>(best - first);
      }
    }
  }
  keepBest(max_results, &matches);
  return matches;
}

}  // namespace vcharge
