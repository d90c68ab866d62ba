#include "vcharge_reconstruction/landmarks/landmark_search.h"

#include <algorithm>
#include <cmath>
#include <functional>
#include <map>
#include <numeric>
#include <set>
#include <unordered_map>
#include <utility>
#include <vector>

#include <tbb/parallel_for.h>

#include "landmarks/track_observations.h"
#include "vcharge_core/base/error.h"
#include "vcharge_features/descriptor_matching.h"

namespace vcharge {
namespace {

constexpr double kReferenceWidth_px = 1280.0;
/// Descriptors are comparable between views whose directions and ranges differ by less.
constexpr double kMaxViewAngle_rad = 0.6;
constexpr double kMaxRangeRatio = 1.8;
/// Two landmarks whose ranges differ by more are not merged.
constexpr double kMaxMergeRatio = 1.25;

MatchOptions closeMatches() {
  MatchOptions options;
  options.max_ratio = 0.8;
  options.max_distance = 60.0;
  return options;
}

/// The earlier observation of a landmark with the most similar view.
struct Source {
  int32_t track = -1;
  const TrackObservation* observation = nullptr;
  double cos_angle = -1.0;
};

/// A feature that matches a landmark.
struct Proposal {
  int32_t keyframe, camera, feature, track;
};

/// True for two keyframes, by number, that are compared with each other.
using AreCompared = std::function<bool(int32_t, int32_t)>;

class LandmarkSearch {
 public:
  LandmarkSearch(const LandmarkSearchOptions& options, const ReconstructionData& data,
                 AreCompared are_compared)
      : options_(options),
        data_(data),
        are_compared_(std::move(are_compared)),
        observed_(data.keyframes.size()) {
    for (size_t t = 0; t < data.tracks.size(); ++t) {
      if (!data.tracks[t].position_m) {
        continue;
      }
      for (const TrackObservation& observation : data.tracks[t].observations) {
        if (observation.feature >= 0) {
          observed_[observation.keyframe].push_back({static_cast<int32_t>(t), &observation});
        }
      }
    }
  }

  std::vector<Proposal> searchKeyframe(int32_t keyframe) const {
    std::vector<Proposal> proposals;
    const std::vector<size_t> neighbours = neighboursOf(keyframe);
    for (int32_t camera = 0; camera < static_cast<int32_t>(data_.rig->cameras.size()); ++camera) {
      if (!data_.keyframes[keyframe].images[camera].features.empty()) {
        searchImage(keyframe, camera, neighbours, &proposals);
      }
    }
    return proposals;
  }

 private:
  std::vector<size_t> neighboursOf(int32_t keyframe) const {
    std::vector<size_t> neighbours;
    const Eigen::Vector3d& position = data_.keyframes[keyframe].map_from_vehicle.translation();
    for (size_t i = 0; i < data_.keyframes.size(); ++i) {
      if (static_cast<int32_t>(i) != keyframe && are_compared_(static_cast<int32_t>(i), keyframe) &&
          (data_.keyframes[i].map_from_vehicle.translation() - position).norm() <= options_.max_distance_m) {
        neighbours.push_back(i);
      }
    }
    return neighbours;
  }

  Eigen::Vector3d cameraCentre(int32_t keyframe, int32_t camera) const {
    return data_.keyframes[keyframe].map_from_vehicle *
           data_.rig->cameras[camera].vehicle_from_camera->translation();
  }

  void searchImage(int32_t keyframe, int32_t camera, const std::vector<size_t>& neighbours,
                   std::vector<Proposal>* proposals) const {
    const Eigen::Vector3d centre = cameraCentre(keyframe, camera);
    const double min_cos_view = std::cos(kMaxViewAngle_rad);
    std::unordered_map<int32_t, size_t> index_of_track;
    std::vector<Source> sources;
    for (const size_t neighbour : neighbours) {
      for (const auto& [track, observation] : observed_[neighbour]) {
        const Eigen::Vector3d& point = *data_.tracks[track].position_m;
        const Eigen::Vector3d from_here = point - centre;
        const Eigen::Vector3d from_there = point - cameraCentre(observation->keyframe, observation->camera);
        const double range = from_here.norm(), other_range = from_there.norm();
        if (range > kMaxRangeRatio * other_range || other_range > kMaxRangeRatio * range) {
          continue;
        }
        const double cos_angle = from_here.dot(from_there) / (range * other_range);
        if (cos_angle < min_cos_view) {
          continue;
        }
        const auto [found, is_new] = index_of_track.emplace(track, sources.size());
        if (is_new) {
          sources.push_back({track, observation, cos_angle});
        } else if (cos_angle > sources[found->second].cos_angle) {
          sources[found->second] = {track, observation, cos_angle};
        }
      }
    }
    matchSources(keyframe, camera, sources, proposals);
  }

  void matchSources(int32_t keyframe, int32_t camera, const std::vector<Source>& sources,
                    std::vector<Proposal>* proposals) const {
    const RigCamera& rig_camera = data_.rig->cameras[camera];
    const KeyframeImage& image = data_.keyframes[keyframe].images[camera];
    const MovingCamera moving = cameraAt(data_.keyframes[keyframe], *data_.rig, camera);
    const double min_cos_field = std::cos(0.5 * rig_camera.field_of_view_rad);
    std::vector<cv::Point2f> predictions;
    std::vector<int32_t> tracks;
    cv::Mat descriptors(0, image.features.descriptors.cols, image.features.descriptors.type());
    descriptors.reserve(sources.size());
    for (const Source& source : sources) {
      const Eigen::Vector3d point = moving.pointInCamera(*data_.tracks[source.track].position_m);
      Eigen::Vector2d pixel;
      if (point.z() < min_cos_field * point.norm() || !rig_camera.model.project(point, &pixel) ||
          pixel.x() < 0.0 || pixel.y() < 0.0 || pixel.x() >= rig_camera.image_size_px.width ||
          pixel.y() >= rig_camera.image_size_px.height) {
        continue;
      }
      const TrackObservation& seen = *source.observation;
      predictions.emplace_back(static_cast<float>(pixel.x()), static_cast<float>(pixel.y()));
      tracks.push_back(source.track);
      descriptors.push_back(
          data_.keyframes[seen.keyframe].images[seen.camera].features.descriptors.row(seen.feature));
    }
    if (tracks.empty()) {
      return;
    }
    std::vector<cv::Point2f> positions;
    for (const Keypoint& keypoint : image.features.keypoints) {
      positions.push_back(keypoint.position_px);
    }
    const double radius_px = options_.radius_px * rig_camera.image_size_px.width / kReferenceWidth_px;
    for (const FeatureMatch& match : matchNearPixels(descriptors, predictions, image.features.descriptors,
                                                     positions, radius_px, closeMatches())) {
      const int32_t track = tracks[match.first_index];
      if (image.track_of_feature[match.second_index] != track) {
        proposals->push_back({keyframe, camera, match.second_index, track});
      }
    }
  }

  const LandmarkSearchOptions& options_;
  const ReconstructionData& data_;
  const AreCompared are_compared_;
  std::vector<std::vector<std::pair<int32_t, const TrackObservation*>>> observed_;
};

/// Disjoint sets of tracks that show the same landmark.
class TrackGroups {
 public:
  explicit TrackGroups(size_t size) : parent_(size) { std::iota(parent_.begin(), parent_.end(), 0); }
  int32_t find(int32_t track) {
    while (parent_[track] != track) {
      parent_[track] = parent_[parent_[track]];
      track = parent_[track];
    }
    return track;
  }
  /// The lower index represents the union.
  void merge(int32_t a, int32_t b) {
    a = find(a);
    b = find(b);
    parent_[std::max(a, b)] = std::min(a, b);
  }

 private:
  std::vector<int32_t> parent_;
};

/// The images that observe each landmark. Two landmarks observed in one image are different ones.
class ImagesOfTracks {
 public:
  explicit ImagesOfTracks(const ReconstructionData& data) : images_(data.tracks.size()) {
    for (size_t t = 0; t < data.tracks.size(); ++t) {
      for (const TrackObservation& observation : data.tracks[t].observations) {
        images_[t].insert({observation.keyframe, observation.camera});
      }
    }
  }
  /// False if the image observes the track already.
  bool add(int32_t track, int32_t keyframe, int32_t camera) {
    return images_[track].insert({keyframe, camera}).second;
  }
  /// Joins the images of two representatives at the lower index. False if one image observes both.
  bool merge(int32_t a, int32_t b) {
    std::set<std::pair<int32_t, int32_t>>& to = images_[std::min(a, b)];
    std::set<std::pair<int32_t, int32_t>>& from = images_[std::max(a, b)];
    for (const auto& image : from) {
      if (to.count(image) > 0) {
        return false;
      }
    }
    to.insert(from.begin(), from.end());
    from.clear();
    return true;
  }

 private:
  std::vector<std::set<std::pair<int32_t, int32_t>>> images_;
};

/// Whether a track can be the proposed landmark: it has no position, or lies at a similar range.
bool arePointsOne(const ReconstructionData& data, int32_t track, const Proposal& proposal) {
  const std::optional<Eigen::Vector3d>& own = data.tracks[track].position_m;
  if (!own) {
    return true;
  }
  const Eigen::Vector3d centre = data.keyframes[proposal.keyframe].map_from_vehicle *
                                 data.rig->cameras[proposal.camera].vehicle_from_camera->translation();
  const Eigen::Vector3d to_own = *own - centre;
  const Eigen::Vector3d to_other = *data.tracks[proposal.track].position_m - centre;
  const double ratio = to_own.norm() / to_other.norm();
  return ratio < kMaxMergeRatio && 1.0 / ratio < kMaxMergeRatio;
}

/// Moves the observations of merged tracks to their representative; keeps the better of two in one image.
void joinTracks(TrackGroups* groups, ReconstructionData* data) {
  for (size_t t = 0; t < data->tracks.size(); ++t) {
    const int32_t root = groups->find(static_cast<int32_t>(t));
    if (root != static_cast<int32_t>(t)) {
      std::vector<TrackObservation>& from = data->tracks[t].observations;
      std::vector<TrackObservation>& to = data->tracks[root].observations;
      to.insert(to.end(), from.begin(), from.end());
      if (!data->tracks[root].position_m) {
        data->tracks[root].position_m = data->tracks[t].position_m;
      }
      data->tracks[t] = Track();
      data->tracks[t].joined_to = root;
    }
  }
  for (Track& track : data->tracks) {
    sortObservations(&track);
  }
  for (Keyframe& keyframe : data->keyframes) {
    for (KeyframeImage& image : keyframe.images) {
      for (int32_t& track : image.track_of_feature) {
        track = track >= 0 ? groups->find(track) : -1;
      }
    }
  }
}

LandmarkSearchSummary searchAndJoin(const LandmarkSearchOptions& options, AreCompared are_compared,
                                    ReconstructionData* data) {
  const auto num_keyframes = static_cast<int32_t>(data->keyframes.size());
  std::vector<std::vector<Proposal>> proposals(num_keyframes);
  const LandmarkSearch search(options, *data, std::move(are_compared));
  tbb::parallel_for(int32_t{0}, num_keyframes, [&](int32_t i) { proposals[i] = search.searchKeyframe(i); });

  LandmarkSearchSummary summary;
  TrackGroups groups(data->tracks.size());
  ImagesOfTracks images(*data);
  for (const std::vector<Proposal>& of_keyframe : proposals) {
    for (const Proposal& proposal : of_keyframe) {
      KeyframeImage& image = data->keyframes[proposal.keyframe].images[proposal.camera];
      int32_t& track = image.track_of_feature[proposal.feature];
      if (track < 0) {
        if (!images.add(groups.find(proposal.track), proposal.keyframe, proposal.camera)) {
          continue;  // observed elsewhere in this image
        }
        const cv::Point2f position = image.features.keypoints[proposal.feature].position_px;
        track = proposal.track;
        data->tracks[proposal.track].observations.push_back(
            {proposal.keyframe, proposal.camera, proposal.feature, Eigen::Vector2d(position.x, position.y),
             options.feature_sigma_px});
        ++summary.num_new_observations;
      } else if (groups.find(track) != groups.find(proposal.track) && arePointsOne(*data, track, proposal) &&
                 images.merge(groups.find(track), groups.find(proposal.track))) {
        groups.merge(track, proposal.track);
        ++summary.num_merged_tracks;
      }
    }
  }
  joinTracks(&groups, data);
  return summary;
}

}  // namespace

LandmarkSearchSummary searchLandmarks(const LandmarkSearchOptions& options, ReconstructionData* data,
                                      int32_t first_of_new) {
  return searchAndJoin(
      options, [=](int32_t a, int32_t b) { return std::max(a, b) >= first_of_new; }, data);
}

LandmarkSearchSummary searchLandmarksBetween(const LandmarkSearchOptions& options, int32_t first_of_new,
                                             ReconstructionData* data) {
  check(first_of_new > 0, "searchLandmarksBetween: expected keyframes on both sides");
  return searchAndJoin(
      options, [=](int32_t a, int32_t b) { return (a < first_of_new) != (b < first_of_new); }, data);
}

}  // namespace vcharge
