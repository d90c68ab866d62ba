#include "vcharge_features/place_index.h"

#include <algorithm>
#include <cstddef>

#include <tbb/parallel_for.h>

#include "places/place_ranking.h"
#include "vcharge_core/base/error.h"

namespace vcharge {

PlaceIndex::PlaceIndex(std::shared_ptr<const VocabularyTree> vocabulary, int num_cameras)
    : vocabulary_(std::move(vocabulary)), num_cameras_(num_cameras) {
  check(vocabulary_ != nullptr, "PlaceIndex: needs a vocabulary");
  check(num_cameras >= 1, "PlaceIndex: needs at least one camera");
  postings_.resize(static_cast<size_t>(vocabulary_->numWords()));
}

int PlaceIndex::add(const std::vector<cv::Mat>& descriptors_by_camera) {
  return addAll({descriptors_by_camera});
}

int PlaceIndex::addAll(const std::vector<std::vector<cv::Mat>>& descriptors_of_places) {
  for (const std::vector<cv::Mat>& by_camera : descriptors_of_places) {
    check(by_camera.size() == static_cast<size_t>(num_cameras_),
          "PlaceIndex: one matrix of descriptors per camera");
  }
  const auto num_cameras = static_cast<size_t>(num_cameras_);
  std::vector<BagOfWords> bags(descriptors_of_places.size() * num_cameras);
  tbb::parallel_for(size_t{0}, bags.size(), [&](size_t i) {
    bags[i] = vocabulary_->bagOfWords(descriptors_of_places[i / num_cameras][i % num_cameras]);
  });
  const int first_place = num_places_;
  for (size_t i = 0; i < bags.size(); ++i) {
    for (const WeightedWord& entry : bags[i]) {
      postings_[entry.word].push_back({first_place * num_cameras_ + static_cast<int32_t>(i), entry.weight});
    }
  }
  num_places_ += static_cast<int>(descriptors_of_places.size());
  return first_place;
}

std::vector<PlaceMatch> PlaceIndex::query(const std::vector<cv::Mat>& descriptors_by_camera, int max_results,
                                          int end_place) const {
  check(descriptors_by_camera.size() == static_cast<size_t>(num_cameras_),
        "PlaceIndex: one matrix of descriptors per camera");
  const int num_candidates = std::clamp(end_place, 0, num_places_);
  // Words in common with each image, per camera of the query.
  const size_t num_images = static_cast<size_t>(num_candidates) * static_cast<size_t>(num_cameras_);
  std::vector<std::vector<float>> common(static_cast<size_t>(num_cameras_), std::vector<float>(num_images));
  for (size_t camera = 0; camera < common.size(); ++camera) {
    for (const WeightedWord& entry : vocabulary_->bagOfWords(descriptors_by_camera[camera])) {
      for (const Posting& posting : postings_[entry.word]) {
        if (static_cast<size_t>(posting.image) >= num_images) {
          break;
        }
        common[camera][posting.image] += std::min(entry.weight, posting.weight);
      }
    }
  }
  const auto mostSimilar = [&](const std::vector<float>& of_camera, int place) {
    const auto first = of_camera.begin() + static_cast<ptrdiff_t>(place) * num_cameras_;
    return std::max_element(first, first + num_cameras_);
  };
  std::vector<PlaceMatch> matches(static_cast<size_t>(num_candidates));
  for (int place = 0; place < num_candidates; ++place) {
    matches[place].place = place;
    for (const std::vector<float>& of_camera : common) {
      matches[place].score += *mostSimilar(of_camera, place);
    }
  }
  keepBest(max_results, &matches);
  for (PlaceMatch& match : matches) {
    for (const std::vector<float>& of_camera : common) {
      const auto best = mostSimilar(of_camera, match.place);
      match.cameras.push_back(*best > 0.0F ? static_cast<int>(best - of_camera.begin()) % num_cameras_ : -1);
    }
  }
  return matches;
}

}  // namespace vcharge
