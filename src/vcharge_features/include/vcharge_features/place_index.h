#pragma once

#include <cstdint>
#include <limits>
#include <memory>
#include <vector>

#include <opencv2/core.hpp>

#include "vcharge_features/vocabulary_tree.h"

namespace vcharge {

/// A place whose images are similar to the query's.
struct PlaceMatch {
  int place = -1;      ///< number of the place
  double score = 0.0;  ///< higher is better; in [0, number of cameras] for PlaceIndex
  /// The most similar camera of the place for each camera of the query (-1: none). They differ if the vehicle
  /// passes the place in another direction.
  std::vector<int> cameras;
};

/// Recognizes places by the images of a rig, with an inverted file from words to images (Nister and
/// Stewenius, CVPR 2006). The score of a place is the sum, over the query's cameras, of the similarity to the
/// most similar image of the place. Not thread safe while places are added.
class PlaceIndex {
 public:
  /// Throws std::logic_error without a vocabulary or a camera.
  PlaceIndex(std::shared_ptr<const VocabularyTree> vocabulary, int num_cameras);

  /// Adds a place with the descriptors of each camera (which may be empty) and returns its number, from 0.
  /// Throws std::logic_error for another number of cameras, std::invalid_argument for descriptors of another
  /// kind than the vocabulary's.
  int add(const std::vector<cv::Mat>& descriptors_by_camera);
  /// Adds several places like add(), and quantizes their descriptors in parallel: the same index on any
  /// number of threads. Returns the number of the first. Throws like add(), and then adds none.
  int addAll(const std::vector<std::vector<cv::Mat>>& descriptors_of_places);
  /// At most `max_results` places with a positive score, best first, ties by number. Only places below
  /// `end_place` are considered, to exclude those passed just before. Throws like add().
  std::vector<PlaceMatch> query(const std::vector<cv::Mat>& descriptors_by_camera, int max_results,
                                int end_place = std::numeric_limits<int>::max()) const;
  int numPlaces() const { return num_places_; }

 private:
  struct Posting {
    int32_t image;  ///< place * number of cameras + camera
    float weight;
  };

  const std::shared_ptr<const VocabularyTree> vocabulary_;
  const int num_cameras_;
  int num_places_ = 0;
  std::vector<std::vector<Posting>> postings_;  // per word, ascending by image
};

}  // namespace vcharge
