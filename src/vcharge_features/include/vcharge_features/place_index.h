#pragma once

#include <cstdint>
#include <limits>
#include <memory>
#include <vector>

#include <opencv2/core.hpp>

#include "vcharge_features/vocabulary_tree.h"

namespace vcharge {

/// A place that looks like the query.
struct PlaceMatch {
  int place = -1;      ///< as add() numbered it
  double score = 0.0;  ///< higher is better; PlaceIndex: in [0, number of cameras]
  /// Per camera of the query: the place's camera that looks most alike (-1: none). A place passed in the
  /// opposite direction is seen by another camera.
  std::vector<int> cameras;
};

/// Finds places again by what the cameras of a rig see there: an inverted file from words to images (Nister
/// and Stewenius, CVPR 2006). A place's score adds up, over the query's cameras, the similarity to the most
/// similar image of the place. Not thread safe while places are added.
class PlaceIndex {
 public:
  /// std::logic_error for no vocabulary or fewer than one camera.
  PlaceIndex(std::shared_ptr<const VocabularyTree> vocabulary, int num_cameras);

  /// Adds a place from the descriptors of each camera (empty: the camera saw nothing); returns its number,
  /// which counts from 0. std::logic_error for another number of cameras; std::invalid_argument for
  /// descriptors of another kind than the vocabulary's.
  int add(const std::vector<cv::Mat>& descriptors_by_camera);

  /// Adds many places as add() does one after the other, their descriptors quantized in parallel: the same
  /// index on any number of threads. Returns the first one's number. Errors as add(), and then none is added.
  int addAll(const std::vector<std::vector<cv::Mat>>& descriptors_of_places);

  /// At most `max_results` places with a score above 0, the best first, ties by number; only places below
  /// `end_place` count: a drive should not find what it saw just before. Errors as add().
  std::vector<PlaceMatch> query(const std::vector<cv::Mat>& descriptors_by_camera, int max_results,
                                int end_place = std::numeric_limits<int>::max()) const;

  int numPlaces() const { return num_places_; }

 private:
  struct Posting {
    int32_t image;  ///< place times number of cameras plus camera
    float weight;
  };
  const std::shared_ptr<const VocabularyTree> vocabulary_;
  const int num_cameras_;
  int num_places_ = 0;
  std::vector<std::vector<Posting>> postings_;  // per word, images ascending
};

}  // namespace vcharge
