#include "vcharge_features/place_votes.h"

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <utility>

#include <tbb/parallel_for.h>

#include "matching/descriptor_kernels.h"
#include "places/place_ranking.h"
#include "vcharge_core/base/error.h"

namespace vcharge {
namespace {

/// Number of features that a thread processes at a time.
constexpr int kBlock = 64;
/// Number of buckets that are in memory at a time.
constexpr size_t kBucketsAtATime = 512;

/// A piece of a feature of the query.
struct QueryPiece {
  int bucket;
  int feature;
};

/// Ordered by bucket, as a file has them.
std::vector<QueryPiece> piecesOf(const cv::Mat& signatures) {
  std::vector<QueryPiece> pieces;
  for (int feature = 0; feature < signatures.rows; ++feature) {
    for (int piece = 0; piece < PlaceTable::kNumPieces; ++piece) {
      pieces.push_back({PlaceTable::bucketOf(signatures.ptr(feature), piece), feature});
    }
  }
  std::sort(pieces.begin(), pieces.end(), [](const QueryPiece& a, const QueryPiece& b) {
    return std::make_pair(a.bucket, a.feature) < std::make_pair(b.bucket, b.feature);
  });
  return pieces;
}

}  // namespace

PlaceVotes::PlaceVotes(std::shared_ptr<const PlaceTable> table, PlaceSignatures signatures, int num_places,
                       int num_cameras, const PlaceVotesOptions& options)
    : table_(std::move(table)),
      signatures_(std::move(signatures)),
      num_places_(num_places),
      num_cameras_(num_cameras),
      options_((options.validate(), options)) {
  check(table_ != nullptr, "PlaceVotes: needs a table");
  check(num_places >= 0 && num_cameras >= 1, "PlaceVotes: needs at least one camera");
}

std::vector<std::vector<PlaceVotes::Hit>> PlaceVotes::hitsOf(const cv::Mat& signatures) const {
  const std::vector<QueryPiece> pieces = piecesOf(signatures);
  std::vector<std::vector<Hit>> hits(static_cast<size_t>(signatures.rows));
  std::vector<std::vector<PlaceFeature>> buckets(kBucketsAtATime);
  std::vector<std::vector<Hit>> of_piece;
  for (size_t begin = 0; begin < pieces.size();) {
    size_t end = begin, num_buckets = 0;
    std::vector<size_t> bucket_of_piece;
    for (; end < pieces.size(); ++end) {
      if (end == begin || pieces[end].bucket != pieces[end - 1].bucket) {
        if (num_buckets == kBucketsAtATime) {
          break;
        }
        table_->readBucket(pieces[end].bucket, &buckets[num_buckets++]);
      }
      bucket_of_piece.push_back(num_buckets - 1);
    }
    of_piece.assign(end - begin, {});
    tbb::parallel_for(size_t{0}, of_piece.size(), [&](size_t i) {
      const std::vector<PlaceFeature>& bucket = buckets[bucket_of_piece[i]];
      if (bucket.empty()) {
        return;
      }
      std::vector<float> distances(bucket.size());
      hammingToRows(signatures.ptr(pieces[begin + i].feature), bucket[0].signature.data(),
                    sizeof(PlaceFeature), nullptr, bucket.size(), distances.data());
      for (size_t k = 0; k < bucket.size(); ++k) {
        if (distances[k] <= static_cast<float>(options_.max_distance_bits)) {
          const double distance = distances[k] / options_.sigma_bits;
          of_piece[i].push_back({bucket[k].first_place, bucket[k].num_places, bucket[k].camera,
                                 static_cast<float>(std::exp(-0.5 * distance * distance))});
        }
      }
    });
    for (size_t i = 0; i < of_piece.size(); ++i) {
      std::vector<Hit>& of_feature = hits[static_cast<size_t>(pieces[begin + i].feature)];
      of_feature.insert(of_feature.end(), of_piece[i].begin(), of_piece[i].end());
    }
    begin = end;
  }
  return hits;
}

std::vector<PlaceVotes::Vote> PlaceVotes::votesOf(const std::vector<Hit>& hits,
                                                  std::vector<Vote>* best_of_place) const {
  // Only the nearest feature of each place votes, so repeated structure counts once per place, as does a
  // feature with several equal pieces.
  std::vector<int32_t> places;
  for (const Hit& hit : hits) {
    const int32_t end = std::min(num_places_, hit.first_place + hit.num_places);
    for (int32_t place = std::max(0, hit.first_place); place < end; ++place) {
      Vote& best = (*best_of_place)[static_cast<size_t>(place)];
      if (best.image < 0) {
        places.push_back(place);
      }
      if (best.image < 0 || hit.weight > best.weight) {
        best = {place * num_cameras_ + std::clamp(hit.camera, 0, num_cameras_ - 1), hit.weight};
      }
    }
  }
  std::sort(places.begin(), places.end());
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
    const cv::Mat signatures = signatures_.of(descriptors_by_camera[camera]);
    if (signatures.rows == 0) {
      continue;
    }
    const std::vector<std::vector<Hit>> hits = hitsOf(signatures);
    std::vector<std::vector<Vote>> votes(hits.size());
    const int num_blocks = (signatures.rows + kBlock - 1) / kBlock;
    tbb::parallel_for(0, num_blocks, [&](int block) {
      std::vector<Vote> best_of_place(static_cast<size_t>(num_places_), Vote{-1, 0.0F});
      const int end = std::min(signatures.rows, (block + 1) * kBlock);
      for (int i = block * kBlock; i < end; ++i) {
        votes[static_cast<size_t>(i)] = votesOf(hits[static_cast<size_t>(i)], &best_of_place);
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
