#include "vcharge_features/place_index.h"

#include <algorithm>
#include <cstddef>

#include "vcharge_core/error.h"

namespace vcharge {

PlaceIndex::PlaceIndex(std::shared_ptr<const VocabularyTree> vocabulary, int num_cameras)
    : vocabulary_(std::move(vocabulary)), num_cameras_(num_cameras) {
  check(vocabulary_ != nullptr, "PlaceIndex: needs a vocabulary");
  check(num_cameras >= 1, "PlaceIndex: needs at least one camera");
  postings_.resize(static_cast<size_t>(vocabulary_->numWords()));
}

int PlaceIndex::add(const std::vector<cv::Mat>& descriptors_by_camera) {
  check(descriptors_by_camera.size() == static_cast<size_t>(num_cameras_),
        "PlaceIndex: one matrix of descriptors per camera");
  std::vector<BagOfWords> bags;
  for (const cv::Mat& descriptors : descriptors_by_camera) {
    bags.push_back(vocabulary_->bagOfWords(descriptors));
  }
  for (int camera = 0; camera < num_cameras_; ++camera) {
    for (const WeightedWord& entry : bags[camera]) {
      postings_[entry.word].push_back({num_places_ * num_cameras_ + camera, entry.weight});
    }
  }
  return num_places_++;
}

std::vector<PlaceMatch> PlaceIndex::query(const std::vector<cv::Mat>& descriptors_by_camera, int max_results,
                                          int end_place) const {
  check(descriptors_by_camera.size() == static_cast<size_t>(num_cameras_),
        "PlaceIndex: one matrix of descriptors per camera");
  const int num_candidates = std::clamp(end_place, 0, num_places_);
  std::vector<PlaceMatch> matches(static_cast<size_t>(num_candidates));
  for (int i = 0; i < num_candidates; ++i) {
    matches[i].place = i;
    matches[i].cameras.assign(static_cast<size_t>(num_cameras_), -1);
  }
  std::vector<float> common(static_cast<size_t>(num_candidates) * num_cameras_);
  for (int camera = 0; camera < num_cameras_; ++camera) {
    std::fill(common.begin(), common.end(), 0.0F);
    for (const WeightedWord& entry : vocabulary_->bagOfWords(descriptors_by_camera[camera])) {
      for (const Posting& posting : postings_[entry.word]) {
        if (static_cast<size_t>(posting.image) >= common.size()) {
          break;
        }
        common[posting.image] += std::min(entry.weight, posting.weight);
      }
    }
    for (PlaceMatch& match : matches) {
      const auto first = common.begin() + static_cast<ptrdiff_t>(match.place) * num_cameras_;
      const auto best = std::max_element(first, first + num_cameras_);
      if (*best > 0.0F) {
        match.cameras[camera] = static_cast<int>(best - first);
        match.score += *best;
      }
    }
  }
  matches.erase(std::remove_if(matches.begin(), matches.end(),
                               [](const PlaceMatch& match) { return !(match.score > 0.0); }),
                matches.end());
  std::stable_sort(matches.begin(), matches.end(),
                   [](const PlaceMatch& a, const PlaceMatch& b) { return a.score > b.score; });
  matches.resize(std::min(matches.size(), static_cast<size_t>(std::max(max_results, 0))));
  return matches;
}

}  // namespace vcharge
