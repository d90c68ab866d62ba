#include "map_pose/map_places.h"

#include <algorithm>
#include <random>
#include <tuple>

#include <tbb/parallel_for.h>
#include <opencv2/core.hpp>

#include "vcharge_core/base/error.h"
#include "vcharge_core/base/quantile.h"

namespace vcharge {
namespace {

// A feature in a file: its signature, and a little-endian number of 32 bits with first_place (24 bits),
// num_places - 1 and camera (4 bits each).
constexpr size_t kSignatureBytes = sizeof(PlaceFeature::signature);
constexpr size_t kFeatureBytes = kSignatureBytes + sizeof(uint32_t);
constexpr int32_t kMaxPlaceInFile = (1 << 24) - 1;
constexpr int32_t kMaxCameraInFile = 15;

/// Keyframes that a landmark may be missing at within a run of observations.
constexpr int kMaxGap = 1;
/// Longest run that one descriptor stands for, since views differ more and more (a file holds up to 16).
constexpr int kMaxRun = 16;
/// A landmark that a camera saw less often is hardly seen again.
constexpr size_t kMinObservations = 3;
/// Observations among which the most similar one is searched.
constexpr size_t kMaxCompared = 9;
constexpr int kUnrelatedPairs = 1001;

/// Observations of a landmark by one camera at consecutive keyframes of a session; indices, ascending.
using Run = std::vector<int32_t>;

std::vector<Run> runsOf(const SparseMap& map, size_t landmark) {
  const auto [begin, end] = map.observationsOfLandmark(landmark);
  std::vector<int32_t> observations(begin, end);
  const auto keyOf = [&](int32_t i) {
    const MapObservation& observation = map.observations()[static_cast<size_t>(i)];
    return std::make_tuple(observation.camera, observation.keyframe);
  };
  std::sort(observations.begin(), observations.end(),
            [&](int32_t a, int32_t b) { return keyOf(a) < keyOf(b); });
  const auto sessionOf = [&](const MapObservation& observation) {
    return map.keyframes()[static_cast<size_t>(observation.keyframe)].session;
  };
  std::vector<Run> runs;
  for (const int32_t i : observations) {
    const MapObservation& observation = map.observations()[static_cast<size_t>(i)];
    if (!runs.empty()) {
      const MapObservation& first = map.observations()[static_cast<size_t>(runs.back().front())];
      const MapObservation& last = map.observations()[static_cast<size_t>(runs.back().back())];
      if (observation.camera == last.camera && sessionOf(observation) == sessionOf(last) &&
          observation.keyframe - last.keyframe <= kMaxGap + 1 &&
          observation.keyframe - first.keyframe < kMaxRun) {
        runs.back().push_back(i);
        continue;
      }
    }
    runs.push_back({i});
  }
  return runs;
}

/// The row with the least sum of distances to the others.
int32_t mostSimilarRow(const cv::Mat& signatures, const Run& run) {
  std::vector<int32_t> compared;
  const size_t count = std::min(run.size(), kMaxCompared);
  for (size_t i = 0; i < count; ++i) {
    compared.push_back(run[i * run.size() / count]);
  }
  int32_t best = compared[0];
  double least = -1.0;
  for (const int32_t row : compared) {
    double sum = 0.0;
    for (const int32_t other : compared) {
      sum += cv::norm(signatures.row(row), signatures.row(other), cv::NORM_HAMMING);
    }
    if (least < 0.0 || sum < least) {
      best = row;
      least = sum;
    }
  }
  return best;
}

}  // namespace

std::vector<PlaceFeature> placeFeaturesOf(const SparseMap& map, const PlaceSignatures& signatures) {
  const cv::Mat rows = signatures.of(map.descriptors());
  std::vector<std::vector<PlaceFeature>> of_landmark(map.landmarks().size());
  tbb::parallel_for(size_t{0}, of_landmark.size(), [&](size_t landmark) {
    const std::vector<Run> runs = runsOf(map, landmark);
    size_t longest = 0;
    for (const Run& run : runs) {
      longest = std::max(longest, run.size());
    }
    for (const Run& run : runs) {
      if (run.size() < std::min(kMinObservations, longest)) {
        continue;
      }
      const MapObservation& first = map.observations()[static_cast<size_t>(run.front())];
      const MapObservation& last = map.observations()[static_cast<size_t>(run.back())];
      PlaceFeature feature;
      std::copy_n(rows.ptr(mostSimilarRow(rows, run)), feature.signature.size(), feature.signature.begin());
      feature.first_place = first.keyframe;
      feature.num_places = last.keyframe - first.keyframe + 1;
      feature.camera = first.camera;
      of_landmark[landmark].push_back(feature);
    }
  });
  std::vector<PlaceFeature> features;
  for (const std::vector<PlaceFeature>& some : of_landmark) {
    features.insert(features.end(), some.begin(), some.end());
  }
  return features;
}

double medianUnrelatedDistance(const SparseMap& map) {
  const cv::Mat& descriptors = map.descriptors();
  if (descriptors.rows < 2) {
    return 0.0;
  }
  const int norm = descriptors.type() == CV_8UC1 ? cv::NORM_HAMMING : cv::NORM_L2;
  const auto count = static_cast<uint32_t>(descriptors.rows);
  std::mt19937 random(1);
  std::vector<double> distances;
  for (int i = 0; i < kUnrelatedPairs; ++i) {
    const auto first = static_cast<int>(random() % count);
    const auto second = static_cast<int>(random() % count);
    const auto landmarkOf = [&](int row) { return map.observations()[static_cast<size_t>(row)].landmark; };
    if (landmarkOf(first) != landmarkOf(second)) {
      distances.push_back(cv::norm(descriptors.row(first), descriptors.row(second), norm));
    }
  }
  return distances.empty() ? 0.0 : quantile(distances, 0.5);
}

std::vector<uint8_t> bytesOf(const std::vector<PlaceFeature>& features) {
  std::vector<uint8_t> bytes;
  bytes.reserve(features.size() * kFeatureBytes);
  for (const PlaceFeature& feature : features) {
    if (feature.first_place > kMaxPlaceInFile || feature.camera > kMaxCameraInFile) {
      continue;  // only rarer to be recognized
    }
    bytes.insert(bytes.end(), feature.signature.begin(), feature.signature.end());
    const auto packed =
        static_cast<uint32_t>(feature.first_place << 8 | (feature.num_places - 1) << 4 | feature.camera);
    for (int shift = 0; shift < 32; shift += 8) {
      bytes.push_back(static_cast<uint8_t>(packed >> shift));
    }
  }
  return bytes;
}

void FilePlaceTable::readBucket(int bucket, std::vector<PlaceFeature>* features) const {
  const std::vector<uint8_t> bytes = reader_.readPlaceRow(bucket);
  features->resize(bytes.size() / kFeatureBytes);
  const uint8_t* at = bytes.data();
  for (PlaceFeature& feature : *features) {
    std::copy_n(at, kSignatureBytes, feature.signature.begin());
    at += kSignatureBytes;
    uint32_t packed = 0;
    for (int shift = 0; shift < 32; shift += 8) {
      packed |= static_cast<uint32_t>(*at++) << shift;
    }
    feature.first_place = static_cast<int32_t>(packed >> 8);
    feature.num_places = static_cast<int32_t>(packed >> 4 & 15) + 1;
    feature.camera = static_cast<int32_t>(packed & 15);
  }
}

}  // namespace vcharge
