#include "vcharge_core/sparse_map/sparse_map.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <numeric>
#include <stdexcept>
#include <tuple>

#include "vcharge_core/base/error.h"
#include "vcharge_core/files/content_hash.h"

namespace vcharge {
namespace {

void require(bool condition, const std::string& member, const char* requirement) {
  if (!condition) {
    throw std::invalid_argument("sparse map: " + member + ": " + requirement);
  }
}

std::string numbered(const char* member, size_t index) {
  return std::string(member) + "[" + std::to_string(index) + "]";
}

bool isBelow(int32_t index, size_t count) {
  return index >= 0 && static_cast<size_t>(index) < count;
}

void checkContents(const SparseMapContents& contents) {
  require(!contents.rig.cameras.empty() && contents.rig.hasExtrinsics(), "rig",
          "expected cameras with vehicle_from_camera");
  for (size_t i = 0; i < contents.sessions.size(); ++i) {
    require(contents.sessions[i].component >= 0, numbered("sessions", i), "expected a component from 0");
  }
  for (size_t i = 0; i < contents.keyframes.size(); ++i) {
    const MapKeyframe& keyframe = contents.keyframes[i];
    require(keyframe.covariance.allFinite(), numbered("keyframes", i), "expected a finite covariance");
    require(isBelow(keyframe.session, contents.sessions.size()), numbered("keyframes", i),
            "expected the index of a session");
    if (i > 0) {
      const MapKeyframe& previous = contents.keyframes[i - 1];
      require(std::tie(previous.session, previous.stamp) < std::tie(keyframe.session, keyframe.stamp),
              numbered("keyframes", i), "expected sessions in order and increasing stamps");
    }
  }
  std::vector<bool> is_seen(contents.landmarks.size(), false);
  for (size_t i = 0; i < contents.observations.size(); ++i) {
    const MapObservation& observation = contents.observations[i];
    require(isBelow(observation.keyframe, contents.keyframes.size()) &&
                isBelow(observation.camera, contents.rig.cameras.size()) &&
                isBelow(observation.landmark, contents.landmarks.size()),
            numbered("observations", i), "expected indices of a keyframe, a camera and a landmark");
    require(observation.position_px.allFinite(), numbered("observations", i), "expected a finite position");
    is_seen[observation.landmark] = true;
  }
  for (size_t i = 0; i < contents.landmarks.size(); ++i) {
    require(contents.landmarks[i].position_m.allFinite() && contents.landmarks[i].covariance_m2.allFinite(),
            numbered("landmarks", i), "expected finite numbers");
    require(std::isfinite(contents.landmarks[i].presence_log_odds), numbered("landmarks", i),
            "expected finite odds");
    require(is_seen[i], numbered("landmarks", i), "expected an observation");
  }
  for (size_t i = 0; i < contents.loop_edges.size(); ++i) {
    require(isBelow(contents.loop_edges[i].first, contents.keyframes.size()) &&
                isBelow(contents.loop_edges[i].second, contents.keyframes.size()),
            numbered("loop_edges", i), "expected indices of keyframes");
  }
  require(static_cast<size_t>(contents.descriptors.rows) == contents.observations.size(), "descriptors",
          "expected a row per observation");
  require(contents.descriptors.empty() || contents.descriptors.type() == CV_8UC1 ||
              contents.descriptors.type() == CV_32FC1,
          "descriptors", "expected 8-bit or 32-bit numbers");
  require(std::isfinite(contents.odometry_distance_scale) && std::isfinite(contents.odometry_turn_scale),
          "odometry scales", "expected finite numbers");
}

/// Assigns ids to the records that have none; those with one come first.
template <class Record>
void assignIds(const char* member, std::vector<Record>* records, int32_t* next) {
  for (size_t i = 0; i < records->size(); ++i) {
    int32_t& id = (*records)[i].id;
    if (id == kNoId) {
      require(*next < std::numeric_limits<int32_t>::max(), numbered(member, i), "no id is left");
      id = (*next)++;
    }
    require(id >= 0 && id < *next && (i == 0 || (*records)[i - 1].id < id), numbered(member, i),
            "expected increasing ids below the next one");
  }
}

void sortObservations(SparseMapContents* contents) {
  std::vector<size_t> order(contents->observations.size());
  std::iota(order.begin(), order.end(), size_t{0});
  const auto key = [&](size_t i) {
    const MapObservation& observation = contents->observations[i];
    return std::make_tuple(observation.keyframe, observation.camera, observation.landmark);
  };
  const auto isBefore = [&](size_t a, size_t b) { return key(a) < key(b); };
  const auto isNotBefore = [&](size_t a, size_t b) { return !isBefore(a, b); };
  if (std::adjacent_find(order.begin(), order.end(), isNotBefore) == order.end()) {
    return;  // already in order, as in every saved map
  }
  std::sort(order.begin(), order.end(), isBefore);
  std::vector<MapObservation> observations;
  observations.reserve(order.size());
  cv::Mat descriptors(contents->descriptors.size(), contents->descriptors.type());
  for (size_t i = 0; i < order.size(); ++i) {
    require(i == 0 || key(order[i - 1]) < key(order[i]), numbered("observations", order[i]),
            "expected one observation per keyframe, camera and landmark");
    observations.push_back(contents->observations[order[i]]);
    contents->descriptors.row(static_cast<int>(order[i])).copyTo(descriptors.row(static_cast<int>(i)));
  }
  contents->observations = std::move(observations);
  contents->descriptors = descriptors;
}

void addTransform(const RigidTransform& transform, ContentHasher* hasher) {
  for (int i = 0; i < 3; ++i) {
    hasher->add(transform.translation()[i]);
  }
  for (int i = 0; i < 4; ++i) {
    hasher->add(transform.rotation().coeffs()[i]);
  }
}

template <class Matrix>
void addMatrix(const Matrix& matrix, ContentHasher* hasher) {
  for (Eigen::Index i = 0; i < matrix.size(); ++i) {
    hasher->add(static_cast<double>(matrix.data()[i]));
  }
}

/// Sessions, ids and evidence.
void addSessions(const SparseMapContents& contents, ContentHasher* hasher) {
  for (const MapSession& session : contents.sessions) {
    hasher->add(session.name);
    hasher->add(session.recording_hash);
    hasher->add(static_cast<int64_t>(session.component));
  }
  for (const MapKeyframe& keyframe : contents.keyframes) {
    hasher->add(static_cast<int64_t>(keyframe.session));
    hasher->add(static_cast<int64_t>(keyframe.id));
  }
  for (const MapLandmark& landmark : contents.landmarks) {
    hasher->add(static_cast<int64_t>(landmark.id));
    hasher->add(landmark.presence_log_odds);
  }
  hasher->add(static_cast<int64_t>(contents.next_keyframe_id));
  hasher->add(static_cast<int64_t>(contents.next_landmark_id));
}

}  // namespace

SparseMap::SparseMap(SparseMapContents contents) : contents_(std::move(contents)) {
  checkContents(contents_);
  assignIds("keyframes", &contents_.keyframes, &contents_.next_keyframe_id);
  assignIds("landmarks", &contents_.landmarks, &contents_.next_landmark_id);
  sortObservations(&contents_);
  const size_t num_images = contents_.keyframes.size() * contents_.rig.cameras.size();
  begin_of_image_.assign(num_images + 1, 0);
  begin_of_landmark_.assign(contents_.landmarks.size() + 1, 0);
  for (const MapObservation& observation : contents_.observations) {
    ++begin_of_image_[observation.keyframe * contents_.rig.cameras.size() + observation.camera + 1];
    ++begin_of_landmark_[observation.landmark + 1];
  }
  std::partial_sum(begin_of_image_.begin(), begin_of_image_.end(), begin_of_image_.begin());
  std::partial_sum(begin_of_landmark_.begin(), begin_of_landmark_.end(), begin_of_landmark_.begin());
  observations_by_landmark_.resize(contents_.observations.size());
  std::vector<size_t> next(begin_of_landmark_.begin(), begin_of_landmark_.end() - 1);
  for (size_t i = 0; i < contents_.observations.size(); ++i) {
    observations_by_landmark_[next[contents_.observations[i].landmark]++] = static_cast<int32_t>(i);
  }
}

std::pair<size_t, size_t> SparseMap::observationsOf(size_t keyframe, size_t camera) const {
  check(keyframe < contents_.keyframes.size() && camera < contents_.rig.cameras.size(),
        "SparseMap::observationsOf: bad index");
  const size_t image = keyframe * contents_.rig.cameras.size() + camera;
  return {begin_of_image_[image], begin_of_image_[image + 1]};
}

std::pair<const int32_t*, const int32_t*> SparseMap::observationsOfLandmark(size_t landmark) const {
  check(landmark < contents_.landmarks.size(), "SparseMap::observationsOfLandmark: bad index");
  return {observations_by_landmark_.data() + begin_of_landmark_[landmark],
          observations_by_landmark_.data() + begin_of_landmark_[landmark + 1]};
}

std::string SparseMap::contentHash() const {
  return hash(true);
}

std::string SparseMap::contentHashWithoutSessions() const {
  return hash(false);
}

std::string SparseMap::hash(bool with_sessions) const {
  ContentHasher hasher;
  for (const RigCamera& camera : contents_.rig.cameras) {
    hasher.add(camera.name);
    hasher.add(camera.model.name());
    addMatrix(camera.model.parameters(), &hasher);
    addTransform(*camera.vehicle_from_camera, &hasher);
  }
  for (const MapKeyframe& keyframe : contents_.keyframes) {
    hasher.add(keyframe.stamp.nanoseconds());
    addTransform(keyframe.map_from_vehicle, &hasher);
    addMatrix(keyframe.covariance, &hasher);
  }
  for (const MapLandmark& landmark : contents_.landmarks) {
    addMatrix(landmark.position_m, &hasher);
    addMatrix(landmark.covariance_m2, &hasher);
  }
  for (const MapObservation& observation : contents_.observations) {
    hasher.add(static_cast<int64_t>(observation.keyframe));
    hasher.add(static_cast<int64_t>(observation.camera));
    hasher.add(static_cast<int64_t>(observation.landmark));
    addMatrix(observation.position_px, &hasher);
  }
  for (int row = 0; row < contents_.descriptors.rows; ++row) {
    hasher.addBytes(contents_.descriptors.ptr(row),
                    contents_.descriptors.cols * contents_.descriptors.elemSize());
  }
  for (const MapLoopEdge& edge : contents_.loop_edges) {
    hasher.add(static_cast<int64_t>(edge.first));
    hasher.add(static_cast<int64_t>(edge.second));
    addTransform(edge.first_from_second, &hasher);
    hasher.add(static_cast<int64_t>(edge.num_inliers));
    hasher.add(static_cast<int64_t>(edge.accepted));
    hasher.add(edge.reason);
  }
  hasher.add(contents_.feature_options);
  hasher.add(contents_.odometry_distance_scale);
  hasher.add(contents_.odometry_turn_scale);
  if (with_sessions) {
    addSessions(contents_, &hasher);
  }
  return hasher.hex();
}

Trajectory trajectoryOf(const SparseMap& map) {
  Trajectory trajectory;
  for (const MapKeyframe& keyframe : map.keyframes()) {
    trajectory.push_back({keyframe.stamp, keyframe.map_from_vehicle});
  }
  std::stable_sort(trajectory.begin(), trajectory.end(),
                   [](const StampedTransform& a, const StampedTransform& b) { return a.stamp < b.stamp; });
  return trajectory;
}

}  // namespace vcharge
